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

from aick_ros import kernels

_BLOCK = 64  # chosen: rows per block, so that the intermediate results fit the cache
_CHUNK_BYTES = 120_000  # chosen: below the size from which malloc maps, and clears, new pages


def descriptor_distances(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """
    Return the distances of all pairs, NxM float32.

    :param source: N descriptors.
    :param target: M descriptors of the same type.
    """
    distances = np.empty((len(source), len(target)), np.float32)
    if _are_binary(source):
        kernels.bit_distances(source, target, source.shape[1], distances)
        return distances
    start = 0
    for block in _float_blocks(source, target):
        distances[start:start + len(block)] = block
        start += len(block)
    return distances


def pair_distances(source: np.ndarray, target: np.ndarray, source_rows: np.ndarray,
                   target_rows: np.ndarray) -> np.ndarray:
    """
    Return the distances of given pairs, K float32.

    :param source: N descriptors.
    :param target: M descriptors of the same type.
    :param source_rows: K int64, indices of the source; ``target_rows`` likewise.
    """
    distances = np.empty(len(source_rows), np.float32)
    if _are_binary(source):
        kernels.bit_distances_of_pairs(
            source, target, source.shape[1], source_rows, target_rows, distances)
        return distances
    step = max(_CHUNK_BYTES // source[:1].nbytes, 1) if len(source) else 1
    for start in range(0, len(distances), step):
        chunk = slice(start, start + step)
        products = source.take(source_rows[chunk], axis=0)
        products *= target.take(target_rows[chunk], axis=0)
        distances[chunk] = _row_sums(products)
    distances *= -2.0
    distances += _squared_lengths(source).take(source_rows)
    distances += _squared_lengths(target).take(target_rows)
    np.maximum(distances, 0.0, out=distances)  # against rounding
    return distances


def pairs_below(source: np.ndarray, target: np.ndarray,
                bound: float) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the pairs with a distance below a bound.

    :param source: N descriptors.
    :param target: M descriptors of the same type.
    :returns: their rows, 2xK int64, sorted by source, then by target, and their distances, K
        float32.
    """
    if _are_binary(source):
        rows = np.frombuffer(kernels.pairs_of_similar_bits(
            source, target, source.shape[1], bound), np.int64).reshape(2, -1)
        return rows, pair_distances(source, target, *rows)
    numbers, distances, first = [np.empty(0, np.int64)], [np.empty(0, np.float32)], 0
    for block in _float_blocks(source, target):
        near = (block < bound).ravel().nonzero()[0]
        distances.append(block.ravel().take(near))
        numbers.append(near + first)
        first += block.size
    rows = np.array(np.divmod(np.concatenate(numbers), max(len(target), 1)))
    return rows, np.concatenate(distances)


def _are_binary(descriptors: np.ndarray) -> bool:
    return descriptors.dtype == np.uint8


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
