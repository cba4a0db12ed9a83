# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for the closest keypoints under the adaptive distance metric (III-A)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import cv2
import numpy as np

from aick_ros import kernels
from aick_ros.features.descriptors import pair_distances, pairs_below
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import point_fit
from aick_ros.registration.aick.candidates import Candidates
from aick_ros.settings import AickSettings

_DESCRIPTOR_REACH = 1.4  # of lambda_f; chosen for speed, matches do not depend on it
_POSITION_REACH = 2.0  # of the radius needed; chosen for speed, matches do not depend on it
_CUBE_DIAGONAL = math.sqrt(3.0)  # by definition: bound of |v| by its largest component


class Search(ABC):
    """
    Finds the closest target keypoint of each source keypoint.

    :param source: at least one keypoint.
    :param target: at least one keypoint.
    """

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        self._source = point_fit.homogeneous(source.positions)
        self._target = point_fit.homogeneous(target.positions)
        self._settings = settings

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
        return self._candidates(moved, w, threshold).closest(moved, self._target, w, threshold)

    @abstractmethod
    def _candidates(self, moved: np.ndarray, w: float, threshold: float) -> Candidates:
        """
        Return at least the pairs that can match: d_d < threshold/w, d_e < threshold/(1-w).

        :param moved: Nx4 float32, the source in the target frame, homogeneous.
        """


class FullSearch(Search):
    """
    Compares every source keypoint with every target keypoint, less those that cannot match.

    A match must have d = (1 - w) d_e + w d_d below the threshold of Eq. 2. Neither term is
    negative, so each alone must be below it: this bounds d_d while w is large, and d_e while w is
    small. Pairs beyond the bound cannot match, and skipping them does not change the result. The
    other pairs are listed once, and the list is used in later iterations while it still contains
    all pairs within the bound.
    """

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        super().__init__(source, target, settings)
        self._descriptors = source.descriptors, target.descriptors
        self._near_in_appearance: Candidates | None = None
        self._near_in_space: Candidates | None = None
        self._listed_source = self._source  # the moved source when _near_in_space was listed
        self._listed_radius = 0.0  # the radius of that list [m]

    def _candidates(self, moved: np.ndarray, w: float, threshold: float) -> Candidates:
        bound = _DESCRIPTOR_REACH * self._settings.lambda_f
        if threshold <= w * bound:
            if self._near_in_appearance is None:
                self._near_in_appearance = Candidates(*pairs_below(*self._descriptors, bound))
            return self._near_in_appearance
        radius = threshold / (1.0 - w)
        # an upper bound of how far a source keypoint has moved since the list was made
        moved_by = _CUBE_DIAGONAL * cv2.norm(moved, self._listed_source, cv2.NORM_INF)
        if self._near_in_space is None or radius + moved_by > self._listed_radius:
            self._listed_source, self._listed_radius = moved, _POSITION_REACH * radius
            self._near_in_space = self._by_position(moved, self._listed_radius)
        return self._near_in_space

    def _by_position(self, moved: np.ndarray, radius: float) -> Candidates:
        """Return the pairs with d_e below a radius [m]."""
        rows = np.frombuffer(kernels.pairs_of_near_points(moved, self._target, radius),
                             np.int64).reshape(2, -1)
        return Candidates(rows, pair_distances(*self._descriptors, *rows))
