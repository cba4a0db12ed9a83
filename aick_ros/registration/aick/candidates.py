# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs of keypoints that may match, and the closest pair of each source keypoint."""

from __future__ import annotations

import sys

import numpy as np

_ONES = np.ones(4, np.float32)
_HIGH_HALF = 1 if sys.byteorder == 'little' else 0  # of an int64 viewed as two 32-bit numbers


class Candidates:
    """
    Pairs that may match, sorted by source keypoint, then by target keypoint.

    :param rows: 2xK, row of the source keypoint and row of the target keypoint of each pair.
    :param descriptor_distances: K float32, d_d of each pair.
    :param target_points: Mx4 float32, all target keypoints as
        :func:`aick_ros.geometry.point_fit.homogeneous` returns them.
    """

    def __init__(self, rows: np.ndarray, descriptor_distances: np.ndarray,
                 target_points: np.ndarray) -> None:
        self.descriptor_distances = descriptor_distances
        self._rows = rows
        self._target_points = target_points
        self._points_of_pairs = target_points.take(rows[1], axis=0)
        self._keys = np.arange(rows.shape[1], dtype=np.int64)
        self._high_halves = self._keys.view(np.float32)[_HIGH_HALF::2]
        self._run_starts = _run_starts(rows[0])

    def where(self, mask: np.ndarray) -> Candidates:
        """Return the pairs that a mask selects."""
        kept = mask.nonzero()[0]
        return Candidates(self._rows.take(kept, axis=1), self.descriptor_distances.take(kept),
                          self._target_points)

    def squared_distances(self, moved: np.ndarray) -> np.ndarray:
        """
        Return the squared Euclidean distance of each pair [m^2], K float32.

        :param moved: Nx4 float32, all source keypoints in the target frame, homogeneous.
        """
        difference = moved.take(self._rows[0], axis=0)
        difference -= self._points_of_pairs
        return squared_lengths(difference)

    def best_matches(self, d: np.ndarray, threshold: float) -> np.ndarray:
        """
        Return the pair with the smallest d of each source keypoint if d is below a threshold.

        :param d: K float32, none negative.
        :returns: rows (source, target), one per matched source keypoint, in the order of the
            source; of pairs with equal d the first.
        """
        if len(d) == 0:
            return np.empty((0, 2), np.intp)
        # The bits of floats that are not negative, read as integers, are in the same order. With
        # d in the high half of a key and the number of the pair in the low half, the smallest key
        # of a source keypoint gives the smallest d, and the pair that has it.
        self._high_halves[:] = d
        smallest = np.minimum.reduceat(self._keys, self._run_starts)
        bound = int(np.float32(threshold).view(np.int32)) << 32
        pairs = smallest[smallest < bound]
        pairs &= 0xffffffff
        return self._rows.take(pairs, axis=1).T


def squared_lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the squared lengths of Nx4 float32 vectors; the vectors are overwritten."""
    vectors *= vectors
    lengths: np.ndarray = vectors @ _ONES
    return lengths


def _run_starts(values: np.ndarray) -> np.ndarray:
    """Return the index at which each run of equal values starts, for sorted values."""
    differs = np.ones(len(values), bool)
    np.not_equal(values[1:], values[:-1], out=differs[1:])
    return differs.nonzero()[0]
