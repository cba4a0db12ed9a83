# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for the closest keypoints under the adaptive metric (III-A)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import cv2
import numpy as np

from aick_ros.features.descriptors import distance_blocks, pair_distances
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import point_fit
from aick_ros.registration.aick.candidates import Candidates, squared_lengths
from aick_ros.settings import AickSettings

_APPEARANCE_REACH = 1.4
_POSITION_REACH = 2.0
_BLOCK = 64  # rows compared at once: what they need fits into the cache
_DIAGONAL = math.sqrt(3.0)  # of a cube: no vector is longer by its largest component
_CROSS_TERM = np.array([-2.0, -2.0, -2.0, 1.0], np.float32)


class Search(ABC):
    """
    Finds the closest target keypoints, but looks only where it can pay.

    A match must have d = (1-w) d_e + w d_d below the threshold of Eq. 2. Both terms are positive,
    so each of them alone must be, which bounds d_d while w is large and d_e when it is small:
    pairs outside the bound cannot match, and leaving them out changes nothing. The pairs inside
    are kept from one iteration to the next while the bound, and the way the source has moved
    since, allow it.

    :param source: one keypoint or more; target: likewise.
    """

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        # four numbers each, which NumPy gathers several times as fast as three
        self._source = point_fit.homogeneous(source.positions)
        self._target = point_fit.homogeneous(target.positions)
        self._settings = settings
        self._by_appearance: Candidates | None = None
        self._by_position: Candidates | None = None
        self._listed_at = self._source  # where the source was when _by_position was made
        self._listed_radius = 0.0

    def closest(self, T_target_source: np.ndarray, w: float) -> np.ndarray:
        """
        Return the closest target keypoint of each source keypoint, where it is close enough.

        :param T_target_source: 4x4, moves the source.
        :param w: weight of the descriptors, w(i) of Eq. 1.
        :returns: Kx2, rows (source, target) in the order of the source; of equally close target
            keypoints the first is taken.
        """
        threshold = (1.0 - w) * self._settings.lambda_e + w * self._settings.lambda_f
        moved = self._source @ T_target_source.T.astype(np.float32)
        candidates = self._candidates(moved, w, threshold)
        d = candidates.squared_distances(moved)  # made d_e, then d, in place
        np.sqrt(d, out=d)
        d *= 1.0 - w
        d += candidates.distances * np.float32(w)
        return candidates.best_matches(d, threshold)

    @abstractmethod
    def _alike(self, bound: float) -> Candidates:
        """Return the pairs whose descriptors are nearer than a bound."""

    @abstractmethod
    def _near(self, moved: np.ndarray, radius: float) -> Candidates:
        """
        Return the pairs whose positions are nearer than a radius [m]; some more do no harm.

        :param moved: Nx4 float32, the source in the target frame.
        """

    def _candidates(self, moved: np.ndarray, w: float, threshold: float) -> Candidates:
        if threshold <= w * _APPEARANCE_REACH * self._settings.lambda_f:
            if self._by_appearance is None:
                self._by_appearance = self._alike(_APPEARANCE_REACH * self._settings.lambda_f)
            return self._by_appearance
        radius = threshold / (1.0 - w)
        way = _DIAGONAL * cv2.norm(moved, self._listed_at, cv2.NORM_INF)  # at most
        if self._by_position is None or radius + way > self._listed_radius:
            self._by_position = self._near(moved, _POSITION_REACH * radius)
            self._listed_at, self._listed_radius = moved, _POSITION_REACH * radius
        return self._by_position


class FullSearch(Search):
    """Compares every source keypoint with every target keypoint, some of the source at a time."""

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        super().__init__(source, target, settings)
        self._descriptors = source.descriptors, target.descriptors

    def _alike(self, bound: float) -> Candidates:
        found, distances, first = [], [], 0
        for block in distance_blocks(*self._descriptors):
            flat = (block < bound).ravel().nonzero()[0]
            distances.append(block.ravel().take(flat))
            found.append(flat + first)
            first += block.size
        return Candidates(self._rows(found), np.concatenate(distances), self._target)

    def _near(self, moved: np.ndarray, radius: float) -> Candidates:
        centre = self._target.mean(axis=0)
        source, target = moved - centre, self._target - centre
        source_squares, target_squares = (squared_lengths(points.copy())
                                          for points in (source, target))
        # float32 cancels where two large squares are subtracted: widen the net by what it may lose
        slack = 2e-5 * (source_squares.max() + target_squares.max())
        source *= _CROSS_TERM
        source[:, 3], target[:, 3] = source_squares, 1.0
        bounds, found = radius ** 2 + slack - target_squares, []
        for first in range(0, len(source), _BLOCK):
            mask = source[first:first + _BLOCK] @ target.T < bounds
            found.append(mask.ravel().nonzero()[0] + first * len(target))
        rows = self._rows(found)
        return Candidates(rows, pair_distances(*self._descriptors, *rows), self._target)

    def _rows(self, found: list[np.ndarray]) -> np.ndarray:
        return np.array(np.divmod(np.concatenate(found), len(self._target)))
