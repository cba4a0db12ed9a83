# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Adaptive Iterative Closest Keypoint (Ekekrantz et al., ECMR 2013, Sec. III)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import rigid
from aick_ros.fit_covariance import fit_covariance
from aick_ros.frame import KeypointFrame
from aick_ros.search import FullSearch, Search
from aick_ros.settings import AickSettings
from aick_ros.status import Status
from aick_ros.tracks import Tracks
from aick_ros.word_search import WordSearch

_FEWEST = 3  # points that determine a rigid transform


@dataclass(frozen=True, eq=False)
class Disagreement:
    """
    The pose by the keypoints alone less that by the depth images alone, to first order.

    :param difference: 6 (x, y, z, rot x, rot y, rot z) [m, rad].
    :param covariance: 6x6, what noise would make of it.
    """

    difference: np.ndarray
    covariance: np.ndarray


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


class Aick:
    """Registers one keypoint frame to another, without an initial guess."""

    def __init__(self, settings: AickSettings = AickSettings()) -> None:
        self._settings = settings

    def register(self, source: KeypointFrame, target: KeypointFrame) -> Registration:
        """Return where the source was, seen from the target (III-A)."""
        if min(len(source), len(target)) < _FEWEST:
            return _failure(Status.TOO_FEW_KEYPOINTS, f'{len(source)} and {len(target)} keypoints '
                            f'with depth, it takes {_FEWEST}', 0)
        search = self._search(source, target)
        points = [rigid.homogeneous(frame.positions.astype(np.float64))
                  for frame in (source, target)]
        T_target_source = np.eye(4)
        for i in range(self._settings.iterations):
            w = self._settings.alpha ** i
            matches = search.closest(T_target_source, w)
            if len(matches) < _FEWEST:
                return _failure(Status.TOO_FEW_MATCHES, f'{len(matches)} matches in iteration {i} '
                                f'of {len(source)} and {len(target)} keypoints', i + 1)
            matched = points[0].take(matches[:, 0], axis=0), points[1].take(matches[:, 1], axis=0)
            try:
                T_target_source = rigid.fit_moments(matched[0].T @ matched[1])
            except rigid.DegenerateGeometryError as error:
                return _failure(Status.DEGENERATE_GEOMETRY, str(error), i + 1)
        return Registration(Status.OK, f'{len(matches)} matches', T_target_source,
                            fit_covariance(T_target_source, source, target, matches), matches,
                            i + 1, len(matches))

    def _search(self, source: KeypointFrame, target: KeypointFrame) -> Search:
        """Return the search by words where both frames have them of one vocabulary (III-B)."""
        words = source.words, target.words
        if None not in words and words[0].vocabulary is words[1].vocabulary:
            return WordSearch(source, target, self._settings)
        return FullSearch(source, target, self._settings)


def _failure(status: Status, reason: str, iterations: int) -> Registration:
    return Registration(status, reason, np.eye(4), np.diag(np.full(6, np.inf)),
                        np.empty((0, 2), np.intp), iterations)
