# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a registration tells."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from aick_ros.registration.refinement.tracks import Tracks
from aick_ros.registration.status import Status


@dataclass(frozen=True, eq=False)
class Disagreement:
    """
    The pose by the keypoints alone less that by the depth images alone, to first order.

    :param difference: 6 (x, y, z, rot x, rot y, rot z) [m, rad].
    :param covariance: 6x6, what noise would make of it.
    """

    difference: np.ndarray
    covariance: np.ndarray


class Evidence(Enum):
    """What supports the pose of a registration."""

    KEYPOINTS = 'keypoints that agree with the pose'
    DEPTH = 'depth and brightness of most of the view, whatever the number of keypoints'


@dataclass(frozen=True, eq=False)
class Registration:
    """
    Where the source camera was, seen from the target camera, and how sure that is.

    :param status: OK, or why there is no transform; ``reason`` has the numbers.
    :param T_target_source: 4x4 float64 [m]; the identity where the status is not OK.
    :param covariance: 6x6 (x, y, z, rot x, rot y, rot z) about the target's fixed axes
        [m^2, m rad, rad^2]; infinite on the diagonal where the status is not OK.
    :param matches: Kx2, rows (source keypoint, target keypoint) of the last iteration.
    :param iterations: how many were done.
    :param support: keypoints that agree with the transform.
    :param evidence: what supports the transform, where the status is OK.
    :param disagreement: of the two sensors, where a refinement used both.
    :param tracks: keypoints of the source that a refinement found in the target.
    """

    status: Status
    reason: str
    T_target_source: np.ndarray
    covariance: np.ndarray
    matches: np.ndarray
    iterations: int
    support: int = 0
    disagreement: Disagreement | None = None
    tracks: Tracks | None = None
    evidence: Evidence = Evidence.KEYPOINTS


def failed(status: Status, reason: str, iterations: int = 0) -> Registration:
    """Return a registration without a transform."""
    return Registration(status, reason, np.eye(4), unknown(), np.empty((0, 2), np.intp),
                        iterations)


def unknown() -> np.ndarray:
    return np.diag(np.full(6, np.inf))
