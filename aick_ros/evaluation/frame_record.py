# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is kept of each frame of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.odometry import OdometryUpdate
from aick_ros.status import Status
from aick_ros.trajectory import Trajectory

STAGES = ('features', 'registration', 'total')
"""What takes time in a frame; total is the two together."""


@dataclass(frozen=True, eq=False)
class FrameRecord:
    """
    An :class:`OdometryUpdate` without its keypoints, small enough to keep one for each frame.

    :param keypoints: their number; matches likewise.
    :param variances: 6, the diagonal of the pose's covariance [m^2, rad^2].
    :param increment: 4x4, None where the frame was not registered.
    :param increment_variances: 6.
    :param timing: milliseconds of the stages: ``features``, ``registration``, ``total``.
    """

    stamp: int
    status: Status
    reason: str
    T_odom_camera: np.ndarray
    variances: np.ndarray
    keypoints: int
    matches: int
    increment: np.ndarray | None
    increment_variances: np.ndarray
    timing: dict[str, float]

    @classmethod
    def of(cls, update: OdometryUpdate) -> FrameRecord:
        """Return what is kept of an update."""
        return cls(
            update.stamp, update.status, update.reason, update.T_odom_camera,
            np.diag(update.covariance).copy(), len(update.keypoints), len(update.matches),
            update.increment if update.interval > 0 else None,
            np.diag(update.increment_covariance).copy(), update.timing)


def trajectory_of(records: Sequence[FrameRecord]) -> Trajectory:
    """
    Return the path of a run.

    Lost frames are in it with the pose that was held.
    """
    poses = np.array([record.T_odom_camera for record in records]).reshape(-1, 4, 4)
    return Trajectory(np.array([record.stamp for record in records], np.int64), poses)
