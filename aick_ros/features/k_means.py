# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Learning a vocabulary: k-means, and k-majority for binary descriptors (Grana et al. 2013)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.errors import InputError
from aick_ros.features.descriptors import descriptor_distances

_CHUNK = 4096  # descriptors whose distances to all words are held at once
_SEEDED_FROM = 20000  # descriptors, at random: seeding looks at all of them for each word

ROUNDS = 12
"""Of assigning descriptors to words and words to descriptors; more change little."""


def learn_words(descriptors: np.ndarray, count: int, seed: int = 0, rounds: int = ROUNDS,
                progress: Callable[[int], None] = lambda done: None) -> np.ndarray:
    """
    Return the centres of clusters: means, or the majority of each bit.

    They are seeded far apart (k-means++, Arthur and Vassilvitskii 2007); a word that loses all
    its descriptors starts anew at the one that is worst represented. The same descriptors and
    seed give the same words.

    :param descriptors: NxD uint8 (binary, 8 bits a column) or float32.
    :param count: of words.
    :param rounds: most; fewer where nothing changes any more.
    :param progress: told the number of rounds done, after each.
    :returns: count x D, of the type of the descriptors.
    :raises InputError: where there are fewer different descriptors than words.
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
        members, away = _closest(descriptors, words)
        words = _centres(descriptors, members, count)
        empty = np.flatnonzero(np.bincount(members, minlength=count) == 0)
        words[empty] = descriptors[np.argsort(-away, kind='stable')[:len(empty)]]
        progress(done + 1)
        if np.array_equal(members, before):
            break
    return words


def _seeds(descriptors: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return descriptors far from each other: each with a chance that grows with its distance."""
    several = rng.permutation(len(descriptors))[:max(_SEEDED_FROM, 4 * count)]
    sample = np.unique(descriptors[several], axis=0)
    if len(sample) < count:
        sample = np.unique(descriptors, axis=0)
    points = _points(sample)
    chosen = [int(rng.integers(len(sample)))]
    away = _away(points, chosen[0])
    for _ in range(count - 1):
        share = np.cumsum(away, dtype=np.float64)
        place = np.searchsorted(share, rng.random() * share[-1], side='right')
        chosen.append(min(int(place), len(sample) - 1))
        np.minimum(away, _away(points, chosen[-1]), out=away)
    return sample[chosen]


def _away(points: np.ndarray, chosen: int) -> np.ndarray:
    """Return the squared distances of points from one of them."""
    squares = np.einsum('ij,ij->i', points, points)
    away = squares + squares[chosen] - 2.0 * (points @ points[chosen])
    away[chosen] = 0.0
    return np.maximum(away, 0.0)


def _points(descriptors: np.ndarray) -> np.ndarray:
    """Return descriptors as points whose squared distance grows with that of the descriptors."""
    if descriptors.dtype == np.uint8:
        return np.unpackbits(descriptors, axis=1).astype(np.float32)
    return descriptors


def _closest(descriptors: np.ndarray, words: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the closest word of each descriptor, and its distance."""
    members = np.empty(len(descriptors), np.intp)
    away = np.empty(len(descriptors), np.float32)
    for start in range(0, len(descriptors), _CHUNK):
        part = slice(start, start + _CHUNK)
        to_words = descriptor_distances(descriptors[part], words)
        members[part] = to_words.argmin(axis=1)
        away[part] = to_words.min(axis=1)
    return members, away


def _centres(descriptors: np.ndarray, members: np.ndarray, count: int) -> np.ndarray:
    """Return the mean of each cluster, or the majority of its bits; zeros where it is empty."""
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
