# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Squared L2 distances of descriptors: d_d of Eq. 1.

That of binary descriptors is the Hamming distance, here as a share of the bits, so that the
paper's thresholds hold. Descriptors are NxD uint8 (8 bits a column) or float32.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

_BITS = np.array([number.bit_count() for number in range(1 << 16)], np.uint8)
_BLOCK = 64  # rows compared at once: what they need fits into the cache
_SMALL = 120_000  # bytes; larger arrays the system hands out anew, and clears, each time


def descriptor_distances(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """
    Return the distances of all pairs, NxM float32.

    :param source: N descriptors; target: M of the same type.
    """
    distances, start = np.empty((len(source), len(target)), np.float32), 0
    for block in distance_blocks(source, target):
        distances[start:start + len(block)] = block
        start += len(block)
    return distances


def distance_blocks(source: np.ndarray, target: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the rows of :func:`descriptor_distances`, some at a time, all in the same memory."""
    if source.dtype != np.uint8:
        return _float_blocks(source, target)
    if hasattr(np, 'bitwise_count'):
        return _bit_blocks(source, target)
    root = np.sqrt(_share(source))
    return _float_blocks(*(np.unpackbits(descriptors, axis=1).astype(np.float32) * root
                           for descriptors in (source, target)))


def pair_distances(source: np.ndarray, target: np.ndarray, source_rows: np.ndarray,
                   target_rows: np.ndarray) -> np.ndarray:
    """
    Return the distances of some pairs, K float32.

    :param source: N descriptors; target: M of the same type.
    :param source_rows: K, of the source; target_rows: K, of the target.
    """
    combine = _differing_bits if source.dtype == np.uint8 else _products
    step = max(_SMALL // source[:1].nbytes, 1) if len(source) else 1
    distances = np.empty(len(source_rows), np.float32)
    for start in range(0, len(distances), step):
        part = slice(start, start + step)
        distances[part] = combine(source.take(source_rows[part], axis=0),
                                  target.take(target_rows[part], axis=0))
    if combine is _products:
        distances *= -2.0
        distances += _squared_lengths(source).take(source_rows)
        distances += _squared_lengths(target).take(target_rows)
        np.maximum(distances, 0.0, out=distances)
    return distances


def _float_blocks(source: np.ndarray, target: np.ndarray) -> Iterator[np.ndarray]:
    memory = np.empty((_BLOCK, len(target)), np.float32)
    source_squares, target_squares = (_squared_lengths(of)[:, None] for of in (source, target))
    for start in range(0, len(source), _BLOCK):
        rows = slice(start, start + _BLOCK)
        block = memory[:len(source) - start]
        np.matmul(source[rows] * np.float32(-2.0), target.T, out=block)
        block += source_squares[rows]
        block += target_squares.T
        yield np.maximum(block, 0.0, out=block)


def _bit_blocks(source: np.ndarray, target: np.ndarray) -> Iterator[np.ndarray]:
    unit, source, columns = _share(source), _chunks(source), _chunks(target).T.copy()
    differing, counts, sums, memory = (np.empty((_BLOCK, len(target)), kind) for kind in (
        source.dtype, np.uint8, np.uint16, np.float32))
    for start in range(0, len(source), _BLOCK):
        rows = source[start:start + _BLOCK]
        part = slice(len(rows))
        sums[part] = 0
        for number, column in enumerate(columns):
            np.bitwise_xor(rows[:, number, None], column, out=differing[part])
            np.bitwise_count(differing[part], out=counts[part])
            sums[part] += counts[part]
        yield np.multiply(sums[part], unit, out=memory[part])


def _products(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    source *= target
    return source @ _ones(source.shape[1])


def _differing_bits(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    counts = _bit_counts(_chunks(source) ^ _chunks(target)).astype(np.float32)
    return counts @ _ones(counts.shape[1]) * _share(source)


def _squared_lengths(vectors: np.ndarray) -> np.ndarray:
    return (vectors * vectors) @ _ones(vectors.shape[1])


@lru_cache(maxsize=4)
def _ones(count: int) -> np.ndarray:
    """Return ones to sum with, which NumPy's sums along short rows are slower than."""
    ones = np.ones(count, np.float32)
    ones.flags.writeable = False
    return ones


def _share(descriptors: np.ndarray) -> np.float32:
    """Return one bit as a share of all."""
    return np.float32(1.0 / (8 * descriptors.shape[1]))


def _chunks(descriptors: np.ndarray) -> np.ndarray:
    """Return binary descriptors in the largest numbers that hold them."""
    return descriptors.view(np.uint64 if descriptors.shape[1] % 8 == 0 else np.uint8)


def _look_up_bit_counts(numbers: np.ndarray) -> np.ndarray:
    """Return how many bits are set, KxC uint8, perhaps for parts of the numbers."""
    return _BITS.take(numbers.view(np.uint16) if numbers.itemsize == 8 else numbers)


_bit_counts = getattr(np, 'bitwise_count', _look_up_bit_counts)  # new in NumPy 2
