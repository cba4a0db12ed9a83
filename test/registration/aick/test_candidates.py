# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs that may match, against a loop over all of them."""

import numpy as np
import pytest

from aick_ros.geometry.point_fit import homogeneous
from aick_ros.registration.aick.candidates import Candidates, squared_lengths


def pairs(rng, sources=30, targets=40, share=0.15):
    """Return the rows of a share of all pairs, sorted by source, then by target, 2xK."""
    return np.array(np.nonzero(rng.random((sources, targets)) < share))


def made(rows, distances=None, targets=40):
    distances = np.zeros(rows.shape[1]) if distances is None else distances
    points = np.random.default_rng(2).standard_normal((targets, 3))
    return Candidates(rows, distances.astype(np.float32), homogeneous(points.astype(np.float32)))


def by_loop(rows, d, threshold):
    """Return the smallest d below a threshold of each source, the first one of equals."""
    best = {}
    for i, (source, target) in enumerate(rows.T.tolist()):
        if d[i] < threshold and (source not in best or d[i] < best[source][0]):
            best[source] = d[i], target
    return [[source, target] for source, (_, target) in best.items()]


@pytest.mark.parametrize('seed', range(5))
@pytest.mark.parametrize('steps', [4, 1000])
def test_the_smallest_of_each_source_matches_and_of_equals_the_first(seed, steps):
    rng = np.random.default_rng(seed)
    rows = pairs(rng)
    d = (rng.integers(0, steps, rows.shape[1]) / steps).astype(np.float32)
    matches = made(rows).best_matches(d, 0.25)
    assert matches.tolist() == by_loop(rows, d, 0.25)
    assert 10 < len(matches) < 30


def test_one_at_the_threshold_does_not_match_and_the_next_smaller_does():
    rows = np.array([[0, 1, 2], [4, 5, 6]])
    threshold = np.float32(0.3)
    d = np.array([threshold, np.nextafter(threshold, np.float32(0)), 0.0], np.float32)
    assert made(rows).best_matches(d, threshold).tolist() == [[1, 5], [2, 6]]


def test_matches_can_be_asked_for_again():
    rng = np.random.default_rng(7)
    rows = pairs(rng)
    candidates = made(rows)
    for _ in range(3):
        d = rng.random(rows.shape[1], np.float32)
        assert candidates.best_matches(d, 0.5).tolist() == by_loop(rows, d, 0.5)


def test_the_last_of_many_pairs_may_match():
    """Of more than 16 bits number."""
    rows = pairs(np.random.default_rng(1), 300, 300, 1.1)
    d = np.ones(rows.shape[1], np.float32)
    d[-1] = 0.0
    assert made(rows, targets=300).best_matches(d, 0.5).tolist() == [[299, 299]]


def test_no_pairs_are_no_matches():
    nothing = made(np.empty((2, 0), np.intp))
    assert nothing.best_matches(np.empty(0, np.float32), 1.0).shape == (0, 2)


def test_distances_are_those_of_the_two_points_of_each_pair():
    rng = np.random.default_rng(3)
    rows = pairs(rng, targets=50)
    source, target = rng.standard_normal((30, 3)), rng.standard_normal((50, 3))
    candidates = Candidates(rows, np.zeros(rows.shape[1], np.float32),
                            homogeneous(target.astype(np.float32)))
    moved = homogeneous(source.astype(np.float32))
    kept = moved.copy()
    squares = ((source[rows[0]] - target[rows[1]]) ** 2).sum(axis=1)
    for _ in range(2):
        np.testing.assert_allclose(candidates.squared_distances(moved), squares, rtol=1e-4)
    np.testing.assert_array_equal(moved, kept)


def test_a_selection_has_the_pairs_and_their_numbers():
    rng = np.random.default_rng(4)
    rows = pairs(rng)
    distances, d = rng.random((2, rows.shape[1]), np.float32)
    whole = made(rows, distances)
    mask = rng.random(rows.shape[1]) < 0.5
    part = whole.where(mask)
    np.testing.assert_array_equal(part.descriptor_distances, distances[mask])
    assert part.best_matches(d[mask], 0.5).tolist() == by_loop(rows[:, mask], d[mask], 0.5)
    moved = homogeneous(rng.random((30, 3), np.float32))
    np.testing.assert_array_equal(part.squared_distances(moved),
                                  whole.squared_distances(moved)[mask])
    assert whole.where(np.zeros_like(mask)).best_matches(d[:0], 1.0).shape == (0, 2)


def test_squared_lengths_count_all_four_components():
    vectors = np.array([[1, 2, 3, 4], [0, 0, 0, -5], [2, 0, 0, 0]], np.float32)
    assert squared_lengths(vectors).tolist() == [30, 25, 4]
