# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Learning a vocabulary: k-means, and k-majority for binary descriptors (Grana et al. 2013)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.errors import InputError
from aick_ros.features.descriptors import descriptor_distances

_CHUNK = 4096  # descriptors per block: bounds the memory of the distances to all words
_SEEDING_SAMPLE = 20000  # chosen: random descriptors for seeding, whose time grows with them

ROUNDS = 12  # chosen: more change the words little
"""Maximum number of k-means iterations."""


def learn_words(descriptors: np.ndarray, count: int, seed: int = 0, rounds: int = ROUNDS,
                progress: Callable[[int], None] = lambda done: None) -> np.ndarray:
    """
    Return the cluster centres of descriptors: means, or the majority of each bit.

    Seeding is by k-means++ (Arthur and Vassilvitskii 2007). An empty cluster is moved to the
    descriptor with the largest distance to its word. The result depends on descriptors and seed
    only.

    :param descriptors: NxD uint8 (binary, 8 bits per column) or float32.
    :param count: number of words.
    :param rounds: maximum number of iterations; fewer if the assignment converges.
    :param progress: called with the number of completed iterations after each.
    :returns: count x D, of the type of the descriptors.
    :raises InputError: if there are fewer distinct descriptors than words.
    """
    distinct = len(np.unique(descriptors, axis=0))
    if distinct < count:
        raise InputError(f'{len(descriptors)} descriptors, {distinct} of them different, are too '
                         f'few for {count} words: take more frames or fewer words')
    rng = np.random.default_rng(seed)
    words = _seeds(descriptors, count, rng)
    members = np.full(len(descriptors), -1)
    for done in range(rounds):
        before = members
        members, distances = _closest(descriptors, words)
        words = _centres(descriptors, members, count)
        empty = np.flatnonzero(np.bincount(members, minlength=count) == 0)
        words[empty] = descriptors[np.argsort(-distances, kind='stable')[:len(empty)]]
        progress(done + 1)
        if np.array_equal(members, before):
            break
    return words


def _seeds(descriptors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return descriptors drawn with a probability proportional to their squared distance."""
    subset = rng.permutation(len(descriptors))[:max(_SEEDING_SAMPLE, 4 * count)]
    sample = np.unique(descriptors[subset], axis=0)
    if len(sample) < count:
        sample = np.unique(descriptors, axis=0)
    points = _points(sample)
    chosen = [int(rng.integers(len(sample)))]
    squared_distances = _squared_distances(points, chosen[0])
    for _ in range(count - 1):
        cumulative = np.cumsum(squared_distances, dtype=np.float64)
        drawn = np.searchsorted(cumulative, rng.random() * cumulative[-1], side='right')
        chosen.append(min(int(drawn), len(sample) - 1))
        np.minimum(squared_distances, _squared_distances(points, chosen[-1]),
                   out=squared_distances)
    seeds: np.ndarray = sample[chosen]
    return seeds


def _squared_distances(points: np.ndarray, index: int) -> np.ndarray:
    """Return the squared distances of points from one of them."""
    squares = np.einsum('ij,ij->i', points, points)
    distances: np.ndarray = np.maximum(
        squares + squares[index] - 2.0 * (points @ points[index]), 0.0)
    distances[index] = 0.0
    return distances


def _points(descriptors: np.ndarray) -> np.ndarray:
    """Return descriptors as points whose squared L2 distance is proportional to theirs."""
    if descriptors.dtype == np.uint8:
        return np.unpackbits(descriptors, axis=1).astype(np.float32)
    return descriptors


def _closest(descriptors: np.ndarray, words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the closest word of each descriptor, and its distance."""
    members = np.empty(len(descriptors), np.intp)
    distances = np.empty(len(descriptors), np.float32)
    for start in range(0, len(descriptors), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        to_words = descriptor_distances(descriptors[chunk], words)
        members[chunk] = to_words.argmin(axis=1)
        distances[chunk] = to_words.min(axis=1)
    return members, distances


def _centres(descriptors: np.ndarray, members: np.ndarray, count: int) -> np.ndarray:
    """Return the mean or the majority of the bits of each cluster; zeros if it is empty."""
    order = np.argsort(members, kind='stable')
    word, starts = np.unique(members[order], return_index=True)
    sizes = np.diff(starts, append=len(order))[:, None]
    sums = np.empty((len(word), _points(descriptors[:1]).shape[1]))
    for row, (start, size) in enumerate(zip(starts, sizes[:, 0])):
        sums[row] = _points(descriptors[order[start:start + size]]).sum(axis=0, dtype=np.float64)
    words = np.zeros((count, descriptors.shape[1]), descriptors.dtype)
    if descriptors.dtype == np.uint8:
        words[word] = np.packbits(2 * sums > sizes, axis=1)
    else:
        words[word] = sums / sizes
    return words
