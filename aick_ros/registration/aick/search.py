# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for the closest keypoints under the adaptive distance metric (III-A)."""

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

_DESCRIPTOR_REACH = 1.4  # of lambda_f; chosen for speed, matches do not depend on it
_POSITION_REACH = 2.0  # of the radius needed; chosen for speed, matches do not depend on it
_BLOCK = 64  # rows compared at once, chosen for speed: their working memory fits into the cache
_CUBE_DIAGONAL = math.sqrt(3.0)  # by definition: bound of |v| by its largest component
_CROSS_TERM = np.array([-2.0, -2.0, -2.0, 1.0], np.float32)
_ROUNDING = 2e-5  # of squared coordinates in float32; chosen, about 170 units of rounding


class Search(ABC):
    """
    Finds the closest target keypoint of each source keypoint, comparing only promising pairs.

    A match must have d = (1 - w) d_e + w d_d below the threshold of Eq. 2. Neither term is
    negative, so each alone must be below it: this bounds d_d while w is large, and d_e while w is
    small. Pairs beyond the bound cannot match, and skipping them does not change the result. The
    other pairs are listed once, and the list is used in later iterations while it still contains
    all pairs within the bound.

    :param source: at least one keypoint.
    :param target: at least one keypoint.
    """

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        # homogeneous: NumPy gathers rows of four numbers several times as fast as rows of three
        self._source = point_fit.homogeneous(source.positions)
        self._target = point_fit.homogeneous(target.positions)
        self._settings = settings
        self._near_in_appearance: Candidates | None = None
        self._near_in_space: Candidates | None = None
        self._listed_source = self._source  # the moved source when _near_in_space was listed
        self._listed_radius = 0.0  # the radius of that list [m]

    def closest(self, T_target_source: np.ndarray, w: float) -> np.ndarray:
        """
        Return the closest target keypoint of each source keypoint (Eq. 1), less outliers (Eq. 2).

        :param T_target_source: 4x4, moves the source into the target frame.
        :param w: weight of the descriptors, w(i).
        :returns: Kx2, rows (source, target) in the order of the source; of equally close target
            keypoints the first.
        """
        threshold = (1.0 - w) * self._settings.lambda_e + w * self._settings.lambda_f  # Eq. 2
        moved = self._source @ T_target_source.T.astype(np.float32)
        candidates = self._candidates(moved, w, threshold)
        d_e = np.sqrt(candidates.squared_distances(moved))
        d = (1.0 - w) * d_e + np.float32(w) * candidates.descriptor_distances  # Eq. 1
        return candidates.best_matches(d, threshold)

    @abstractmethod
    def _by_descriptor(self, bound: float) -> Candidates:
        """Return the pairs with d_d below a bound."""

    @abstractmethod
    def _by_position(self, moved: np.ndarray, radius: float) -> Candidates:
        """
        Return at least the pairs with d_e below a radius [m].

        :param moved: Nx4 float32, the source in the target frame, homogeneous.
        """

    def _candidates(self, moved: np.ndarray, w: float, threshold: float) -> Candidates:
        """Return at least the pairs that can match: d_d < threshold/w, d_e < threshold/(1-w)."""
        if threshold <= w * _DESCRIPTOR_REACH * self._settings.lambda_f:
            if self._near_in_appearance is None:
                self._near_in_appearance = self._by_descriptor(
                    _DESCRIPTOR_REACH * self._settings.lambda_f)
            return self._near_in_appearance
        radius = threshold / (1.0 - w)
        # an upper bound of how far a source keypoint has moved since the list was made
        moved_by = _CUBE_DIAGONAL * cv2.norm(moved, self._listed_source, cv2.NORM_INF)
        if self._near_in_space is None or radius + moved_by > self._listed_radius:
            self._near_in_space = self._by_position(moved, _POSITION_REACH * radius)
            self._listed_source, self._listed_radius = moved, _POSITION_REACH * radius
        return self._near_in_space


class FullSearch(Search):
    """Compares every source keypoint with every target keypoint, a block of rows at a time."""

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        super().__init__(source, target, settings)
        self._descriptors = source.descriptors, target.descriptors

    def _by_descriptor(self, bound: float) -> Candidates:
        numbers, distances, first = [], [], 0
        for block in distance_blocks(*self._descriptors):
            near = (block < bound).ravel().nonzero()[0]
            distances.append(block.ravel().take(near))
            numbers.append(near + first)
            first += block.size
        return Candidates(self._rows(numbers), np.concatenate(distances), self._target)

    def _by_position(self, moved: np.ndarray, radius: float) -> Candidates:
        # |a - b|^2 = |a|^2 - 2 a.b + |b|^2, about the centre of the target to keep squares small
        centre = self._target.mean(axis=0)
        source, target = moved - centre, self._target - centre
        source_squares, target_squares = (squared_lengths(points.copy())
                                          for points in (source, target))
        # the difference of two large squares loses digits in float32: widen the bound by them
        slack = _ROUNDING * (source_squares.max() + target_squares.max())
        source *= _CROSS_TERM
        source[:, 3], target[:, 3] = source_squares, 1.0
        bounds, numbers = radius ** 2 + slack - target_squares, []
        for first in range(0, len(source), _BLOCK):
            near = source[first:first + _BLOCK] @ target.T < bounds
            numbers.append(near.ravel().nonzero()[0] + first * len(target))
        rows = self._rows(numbers)
        return Candidates(rows, pair_distances(*self._descriptors, *rows), self._target)

    def _rows(self, numbers: list[np.ndarray]) -> np.ndarray:
        """Return the rows, 2xK, of pairs numbered row by row of the NxM table of all pairs."""
        return np.array(np.divmod(np.concatenate(numbers), len(self._target)))
