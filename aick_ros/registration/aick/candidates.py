# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs of keypoints that may match, and the closest pair of each source keypoint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import kernels


@dataclass(frozen=True, eq=False)
class Candidates:
    """
    Pairs that may match, sorted by source keypoint, then by target keypoint.

    :param rows: 2xK int64, row of the source keypoint and row of the target keypoint of each pair.
    :param descriptor_distances: K float32, d_d of each pair.
    """

    rows: np.ndarray
    descriptor_distances: np.ndarray

    def closest(self, moved: np.ndarray, target: np.ndarray, w: float,
                threshold: float) -> np.ndarray:
        """
        Return the pair with the smallest d of each source keypoint if d is below a threshold.

        :param moved: Nx4 float32, all source keypoints in the target frame, as
            :func:`aick_ros.geometry.point_fit.homogeneous` returns them.
        :param target: Mx4 float32, all target keypoints likewise.
        :param w: weight of the descriptors in d (Eq. 1).
        :returns: Kx2, rows (source, target), one per matched source keypoint, in the order of the
            source; of pairs with equal d the first.
        """
        matches = np.empty((len(moved), 2), np.int64)
        found = kernels.closest_pairs(moved, target, self.rows, self.descriptor_distances,
                                      1.0 - w, w, threshold, matches)
        return matches[:found]
