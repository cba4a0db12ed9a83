# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Descriptor distances d_d (Eq. 1): squared L2, or normalised Hamming.

The squared L2 distance of bit vectors is the Hamming distance. It is divided by the number of
bits, so that the thresholds of the paper apply. Descriptors are NxD uint8 (8 bits per column) or
float32.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np

_BITS = np.array([number.bit_count() for number in range(1 << 16)], np.uint8)
_BLOCK = 64  # chosen: rows per block, so that the intermediate results fit the cache
_CHUNK_BYTES = 120_000  # chosen: below the size from which malloc maps, and clears, new pages


def descriptor_distances(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """
    Return the distances of all pairs, NxM float32.

    :param source: N descriptors.
    :param target: M descriptors of the same type.
    """
    distances, start = np.empty((len(source), len(target)), np.float32), 0
    for block in distance_blocks(source, target):
        distances[start:start + len(block)] = block
        start += len(block)
    return distances


def distance_blocks(source: np.ndarray, target: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the rows of :func:`descriptor_distances` in blocks, all in the same buffer."""
    if source.dtype != np.uint8:
        return _float_blocks(source, target)
    if hasattr(np, 'bitwise_count'):
        return _bit_blocks(source, target)
    scale = np.sqrt(_bit_fraction(source))
    return _float_blocks(*(np.unpackbits(descriptors, axis=1).astype(np.float32) * scale
                           for descriptors in (source, target)))


def pair_distances(source: np.ndarray, target: np.ndarray, source_rows: np.ndarray,
                   target_rows: np.ndarray) -> np.ndarray:
    """
    Return the distances of given pairs, K float32.

    :param source: N descriptors.
    :param target: M descriptors of the same type.
    :param source_rows: K indices of the source; ``target_rows`` likewise.
    """
    combine = _differing_bits if source.dtype == np.uint8 else _products
    step = max(_CHUNK_BYTES // source[:1].nbytes, 1) if len(source) else 1
    distances = np.empty(len(source_rows), np.float32)
    for start in range(0, len(distances), step):
        chunk = slice(start, start + step)
        distances[chunk] = combine(source.take(source_rows[chunk], axis=0),
                                   target.take(target_rows[chunk], axis=0))
    if combine is _products:
        distances *= -2.0
        distances += _squared_lengths(source).take(source_rows)
        distances += _squared_lengths(target).take(target_rows)
        np.maximum(distances, 0.0, out=distances)  # against rounding
    return distances


def _float_blocks(source: np.ndarray, target: np.ndarray) -> Iterator[np.ndarray]:
    buffer = np.empty((_BLOCK, len(target)), np.float32)
    source_squares, target_squares = (
        _squared_lengths(vectors)[:, None] for vectors in (source, target))
    for start in range(0, len(source), _BLOCK):
        rows = slice(start, start + _BLOCK)
        block = buffer[:len(source) - start]
        np.matmul(source[rows] * np.float32(-2.0), target.T, out=block)
        block += source_squares[rows]
        block += target_squares.T
        yield np.maximum(block, 0.0, out=block)


def _bit_blocks(source: np.ndarray, target: np.ndarray) -> Iterator[np.ndarray]:
    unit, source, columns = _bit_fraction(source), _words(source), _words(target).T.copy()
    differing, counts, sums, buffer = (np.empty((_BLOCK, len(target)), kind) for kind in (
        source.dtype, np.uint8, np.uint16, np.float32))
    for start in range(0, len(source), _BLOCK):
        rows = source[start:start + _BLOCK]
        used = slice(len(rows))
        sums[used] = 0
        for number, column in enumerate(columns):
            np.bitwise_xor(rows[:, number, None], column, out=differing[used])
            np.bitwise_count(differing[used], out=counts[used])
            sums[used] += counts[used]
        yield np.multiply(sums[used], unit, out=buffer[used])


def _products(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the dot products of the rows; overwrites the source."""
    source *= target
    return _row_sums(source)


def _differing_bits(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the fractions of differing bits of the rows."""
    counts = _bit_counts(_words(source) ^ _words(target)).astype(np.float32)
    fractions: np.ndarray = _row_sums(counts) * _bit_fraction(source)
    return fractions


def _squared_lengths(vectors: np.ndarray) -> np.ndarray:
    return _row_sums(vectors * vectors)


def _row_sums(rows: np.ndarray) -> np.ndarray:
    """Return the sums of the rows, by a product that is faster than NumPy's sum of short rows."""
    sums: np.ndarray = rows @ _ones(rows.shape[1])
    return sums


@lru_cache(maxsize=4)
def _ones(count: int) -> np.ndarray:
    ones = np.ones(count, np.float32)
    ones.flags.writeable = False
    return ones


def _bit_fraction(descriptors: np.ndarray) -> np.float32:
    """Return one bit as a fraction of all bits."""
    return np.float32(1.0 / (8 * descriptors.shape[1]))


def _words(descriptors: np.ndarray) -> np.ndarray:
    """Return a view of binary descriptors as words of 64 bits, or of 8 if the width is odd."""
    return descriptors.view(np.uint64 if descriptors.shape[1] % 8 == 0 else np.uint8)


def _look_up_bit_counts(numbers: np.ndarray) -> np.ndarray:
    """Return the numbers of set bits, KxC uint8; of a 64-bit number for each 16 bits of it."""
    return _BITS.take(numbers.view(np.uint16) if numbers.itemsize == 8 else numbers)


_bit_counts = getattr(np, 'bitwise_count', _look_up_bit_counts)  # NumPy 2 only
