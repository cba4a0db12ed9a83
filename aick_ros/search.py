# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for the closest keypoints under the adaptive metric (III-A)."""

from __future__ import annotations

import math
import sys
from abc import ABC, abstractmethod

import numpy as np

from aick_ros.settings import AickSettings

_APPEARANCE_REACH = 1.4
_POSITION_REACH = 2.0
_ONES = np.ones(3, np.float32)
_HIGH_HALF = 1 if sys.byteorder == 'little' else 0  # of an int64, seen as two int32


def descriptor_distances(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """
    Return the squared L2 distances of all pairs of descriptors.

    That of binary descriptors is the Hamming distance, here as a share of the bits, so that the
    paper's thresholds hold.

    :param source: NxD uint8 (8 bits a column) or float32.
    :param target: MxD of the same type.
    :returns: NxM float32.
    """
    if source.dtype == np.uint8:
        bits = 8 * source.shape[1]
        distances = _signs(source) @ _signs(target).T  # bits that agree less those that differ
        distances *= -0.5 / bits
        distances += 0.5
        return distances
    return _squared_distances(source, target)


class Search(ABC):
    """
    Finds the closest target keypoints, but looks only where it can pay.

    A match must have d = (1-w) d_e + w d_d below the threshold of Eq. 2. Both terms are positive,
    so each of them alone must be, which bounds d_d while w is large and d_e when it is small:
    pairs outside the bound cannot match, and leaving them out changes nothing. The pairs inside
    are kept from one iteration to the next while the bound, and the way the source has moved
    since, allow it.

    :param source_positions: Nx3 float32 [m].
    :param target_positions: Mx3 float32 [m].
    """

    def __init__(self, source_positions: np.ndarray, target_positions: np.ndarray,
                 settings: AickSettings) -> None:
        self._target = target_positions
        self._settings = settings
        self._by_appearance: Candidates | None = None
        self._by_position: Candidates | None = None
        self._listed_at = source_positions  # where the source was when _by_position was made
        self._listed_radius = 0.0

    def closest(self, moved: np.ndarray, w: float) -> np.ndarray:
        """
        Return the closest target keypoint of each source keypoint, where it is close enough.

        :param moved: Nx3 float32, the source positions in the target frame [m].
        :param w: weight of the descriptors, w(i) of Eq. 1.
        :returns: Kx2, rows (source, target) in the order of the source; of equally close target
            keypoints the first is taken.
        """
        threshold = (1.0 - w) * self._settings.lambda_e + w * self._settings.lambda_f
        candidates = self._candidates(moved, w, threshold)
        d = candidates.squared_away(moved)  # made d_e, then d, in place
        np.sqrt(d, out=d)
        d *= np.float32(1.0 - w)
        d += np.float32(w) * candidates.distances
        return candidates.least(d, threshold)

    @abstractmethod
    def _alike(self, bound: float) -> Candidates:
        """Return the pairs whose descriptors are nearer than a bound."""

    @abstractmethod
    def _near(self, moved: np.ndarray, radius: float) -> Candidates:
        """Return the pairs whose positions are nearer than a radius [m]; some more do no harm."""

    def _candidates(self, moved: np.ndarray, w: float, threshold: float) -> Candidates:
        if threshold <= w * _APPEARANCE_REACH * self._settings.lambda_f:
            if self._by_appearance is None:
                self._by_appearance = self._alike(_APPEARANCE_REACH * self._settings.lambda_f)
            return self._by_appearance
        radius = threshold / (1.0 - w)
        way = math.sqrt(_squares(moved - self._listed_at).max())
        if self._by_position is None or radius + way > self._listed_radius:
            self._by_position = self._near(moved, _POSITION_REACH * radius)
            self._listed_at, self._listed_radius = moved, _POSITION_REACH * radius
        return self._by_position


class FullSearch(Search):
    """
    Compares every source keypoint with every target keypoint.

    :param distances: NxM float32, :func:`descriptor_distances`.
    """

    def __init__(self, source_positions: np.ndarray, target_positions: np.ndarray,
                 distances: np.ndarray, settings: AickSettings) -> None:
        super().__init__(source_positions, target_positions, settings)
        self._distances = distances

    def _alike(self, bound: float) -> Candidates:
        return self._pairs(self._distances < bound)

    def _near(self, moved: np.ndarray, radius: float) -> Candidates:
        centre = self._target.mean(axis=0)
        source, target = moved - centre, self._target - centre
        squares = _squared_distances(source, target)
        # float32 cancels where two large squares are subtracted: widen the net by what it may lose
        slack = 1e-5 * (np.max(np.abs(source)) + np.max(np.abs(target))) ** 2
        return self._pairs(squares < radius ** 2 + slack)

    def _pairs(self, mask: np.ndarray) -> Candidates:
        flat = np.flatnonzero(mask)
        source, target = np.divmod(flat, mask.shape[1])
        return Candidates(source, target, self._distances.ravel()[flat], self._target)


class Candidates:
    """
    Pairs that may match, sorted by source, then target.

    :param target_positions: Mx3, of all target keypoints.
    """

    def __init__(self, source: np.ndarray, target: np.ndarray, distances: np.ndarray,
                 target_positions: np.ndarray) -> None:
        self.source = source
        self.target = target
        self.distances = distances
        self._target_positions = target_positions
        self._places = target_positions.take(target, axis=0)
        self._keys = np.arange(len(source), dtype=np.int64)  # d comes into the high half
        self._starts = np.flatnonzero(_begins_run(source))

    def where(self, mask: np.ndarray) -> Candidates:
        """Return those of a mask."""
        kept = np.flatnonzero(mask)
        return Candidates(self.source[kept], self.target[kept], self.distances[kept],
                          self._target_positions)

    def squared_away(self, moved: np.ndarray) -> np.ndarray:
        """Return the squared distances of the positions, K float32 [m^2]."""
        difference = moved.take(self.source, axis=0)
        difference -= self._places
        return _squares(difference)

    def least(self, d: np.ndarray, threshold: float) -> np.ndarray:
        """Return the pair of the least d of each source, Kx2, where it is below the threshold."""
        if len(d) == 0:
            return np.empty((0, 2), np.intp)
        # Bits of floats from 0 up are ordered as they are. With its own number behind them, in
        # the low half, the least of each source also says which pair it is, of equals the first.
        self._keys.view(np.float32)[_HIGH_HALF::2] = d
        least = np.minimum.reduceat(self._keys, self._starts)
        bound = int(np.float32(threshold).view(np.int32)) << 32
        best = least[least < bound]
        best &= 0xffffffff
        matches = np.empty((len(best), 2), np.intp)
        matches[:, 0] = self.source.take(best)
        matches[:, 1] = self.target.take(best)
        return matches


def _begins_run(values: np.ndarray) -> np.ndarray:
    """Return which of sorted values differ from the one before them."""
    begins = np.ones(len(values), bool)
    np.not_equal(values[1:], values[:-1], out=begins[1:])
    return begins


def _signs(descriptors: np.ndarray) -> np.ndarray:
    return np.unpackbits(descriptors, axis=1).astype(np.float32) * 2 - 1


def _squares(vectors: np.ndarray) -> np.ndarray:
    """Return the squared lengths of vectors, Nx3 float32, in whose place it works."""
    vectors *= vectors
    return vectors @ _ONES


def _squared_distances(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    squares = source @ target.T
    squares *= -2.0
    squares += np.einsum('ij,ij->i', source, source)[:, None]
    squares += np.einsum('ij,ij->i', target, target)
    return np.maximum(squares, 0.0, out=squares)
