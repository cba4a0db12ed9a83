# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Search for the closest keypoints among those that share a word (III-B)."""

from __future__ import annotations

import numpy as np

from aick_ros.frame import KeypointFrame
from aick_ros.search import Candidates, Search
from aick_ros.settings import AickSettings

_BITS = np.array([number.bit_count() for number in range(1 << 16)], np.uint8)


class WordSearch(Search):
    """
    Compares a source keypoint with the target keypoints that have its closest word in Psi.

    Nothing is as large as the number of all pairs.

    :param source: keypoints with words; target: likewise, of the same vocabulary.
    """

    def __init__(self, source: KeypointFrame, target: KeypointFrame,
                 settings: AickSettings) -> None:
        super().__init__(source.positions, target.positions, settings)
        rows = source.words.pairs(target.words)
        d_d = _pair_distances(source.descriptors, target.descriptors, *rows)
        self._pairs = Candidates(*rows, d_d, target.positions)

    def _alike(self, bound: float) -> Candidates:
        return self._pairs.where(self._pairs.distances < bound)

    def _near(self, moved: np.ndarray, radius: float) -> Candidates:
        return self._pairs.where(self._pairs.squared_away(moved) < radius ** 2)


def _pair_distances(source: np.ndarray, target: np.ndarray, source_rows: np.ndarray,
                    target_rows: np.ndarray) -> np.ndarray:
    """Return what :func:`aick_ros.search.descriptor_distances` has for some pairs, K float32."""
    if source.dtype == np.uint8:
        bits, chunk = 8 * source.shape[1], np.uint64 if source.shape[1] % 8 == 0 else np.uint8
        differing = source.view(chunk).take(source_rows, axis=0)
        differing ^= target.view(chunk).take(target_rows, axis=0)
        counts = _bit_counts(differing).astype(np.float32)
        return counts @ np.full(counts.shape[1], 1.0 / bits, np.float32)
    squares = np.einsum('ij,ij->i', source.take(source_rows, axis=0),
                        target.take(target_rows, axis=0))
    squares *= -2.0
    squares += np.einsum('ij,ij->i', source, source).take(source_rows)
    squares += np.einsum('ij,ij->i', target, target).take(target_rows)
    return np.maximum(squares, 0.0, out=squares)


def _look_up_bit_counts(numbers: np.ndarray) -> np.ndarray:
    """Return how many bits are set, KxC uint8, perhaps for parts of the numbers."""
    return _BITS.take(numbers.view(np.uint16) if numbers.itemsize == 8 else numbers)


_bit_counts = getattr(np, 'bitwise_count', _look_up_bit_counts)  # new in NumPy 2
