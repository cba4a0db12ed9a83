# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs of keypoints that may match, and which of them are the closest."""

from __future__ import annotations

import sys

import numpy as np

_ONES = np.ones(4, np.float32)
_HIGH_HALF = 1 if sys.byteorder == 'little' else 0  # of an int64, seen as two int32


class Candidates:
    """
    Pairs that may match, sorted by source, then target.

    :param rows: 2xK, of the source and of the target keypoints.
    :param distances: K float32, of their descriptors.
    :param target_points: Mx4 float32, all target keypoints, :func:`aick_ros.geometry.point_fit.homogeneous`.
    """

    def __init__(self, rows: np.ndarray, distances: np.ndarray,
                 target_points: np.ndarray) -> None:
        self.distances = distances
        self._rows = rows
        self._target_points = target_points
        self._places = target_points.take(rows[1], axis=0)
        self._keys = np.arange(len(distances), dtype=np.int64)
        self._high_halves = self._keys.view(np.float32)[_HIGH_HALF::2]
        self._starts = _begins_run(rows[0]).nonzero()[0]

    def where(self, mask: np.ndarray) -> Candidates:
        """Return those of a mask."""
        kept = mask.nonzero()[0]
        return Candidates(self._rows.take(kept, axis=1), self.distances.take(kept),
                          self._target_points)

    def squared_distances(self, moved: np.ndarray) -> np.ndarray:
        """Return the squared distances of the positions, K float32 [m^2]."""
        difference = moved.take(self._rows[0], axis=0)
        difference -= self._places
        return squared_lengths(difference)

    def best_matches(self, d: np.ndarray, threshold: float) -> np.ndarray:
        """Return the pair of the least d of each source, Kx2, where it is below the threshold."""
        if len(d) == 0:
            return np.empty((0, 2), np.intp)
        # Bits of floats from 0 up are ordered as they are. With its own number behind them, in
        # the low half, the least of each source also says which pair it is, of equals the first.
        self._high_halves[:] = d
        least = np.minimum.reduceat(self._keys, self._starts)
        bound = int(np.float32(threshold).view(np.int32)) << 32
        best = least[least < bound]
        best &= 0xffffffff
        return self._rows.take(best, axis=1).T


def squared_lengths(vectors: np.ndarray) -> np.ndarray:
    """Return the squared lengths of Nx4 float32, in whose place it works."""
    vectors *= vectors
    return vectors @ _ONES


def _begins_run(values: np.ndarray) -> np.ndarray:
    """Return which of sorted values differ from the one before them."""
    begins = np.ones(len(values), bool)
    np.not_equal(values[1:], values[:-1], out=begins[1:])
    return begins
