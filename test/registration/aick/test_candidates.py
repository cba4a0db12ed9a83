# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs that may match, against a loop over all of them."""

import numpy as np
import pytest

from aick_ros.geometry.point_fit import homogeneous
from aick_ros.registration.aick.candidates import Candidates


def pairs(rng, sources=30, targets=40, share=0.15):
    """Return the rows of a share of all pairs, sorted by source, then by target, 2xK."""
    return np.array(np.nonzero(rng.random((sources, targets)) < share))


def points(count, seed=2, scale=1.0):
    coordinates = scale * np.random.default_rng(seed).standard_normal((count, 3))
    return homogeneous(coordinates.astype(np.float32))


def by_descriptor(rows, d_d, threshold, targets=40):
    """Return the matches at w = 1, where d is d_d."""
    candidates = Candidates(rows, np.asarray(d_d, np.float32))
    return candidates.closest(points(300), points(targets), 1.0, threshold)


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
    matches = by_descriptor(rows, d, 0.25)
    assert matches.tolist() == by_loop(rows, d, 0.25)
    assert 10 < len(matches) < 30


@pytest.mark.parametrize('w', [0.0, 0.2, 0.7])
def test_d_weighs_the_distance_of_the_moved_points_and_that_of_the_descriptors(w):
    rng = np.random.default_rng(3)
    rows, source, target = pairs(rng), points(30, 4, 0.5), points(40, 5, 0.5)
    d_d = rng.random(rows.shape[1], np.float32)
    d_e = np.linalg.norm(source[rows[0], :3].astype(float) - target[rows[1], :3], axis=1)
    kept = source.copy(), target.copy()
    matches = Candidates(rows, d_d).closest(source, target, w, 0.8)
    assert matches.tolist() == by_loop(rows, (1 - w) * d_e + w * d_d, 0.8)
    assert 5 < len(matches) < 30
    np.testing.assert_array_equal(source, kept[0])
    np.testing.assert_array_equal(target, kept[1])


def test_one_at_the_threshold_does_not_match_and_the_next_smaller_does():
    rows = np.array([[0, 1, 2], [4, 5, 6]])
    threshold = np.float32(0.3)
    d = [threshold, np.nextafter(threshold, np.float32(0)), 0.0]
    assert by_descriptor(rows, d, threshold).tolist() == [[1, 5], [2, 6]]


def test_what_is_not_a_number_does_not_match():
    rows = np.array([[0, 0, 1], [4, 5, 6]])
    assert by_descriptor(rows, [np.nan, 0.1, np.nan], 0.5).tolist() == [[0, 5]]


def test_the_last_of_many_pairs_may_match():
    """Of more than 16 bits number."""
    rows = pairs(np.random.default_rng(1), 300, 300, 1.1)
    d = np.ones(rows.shape[1])
    d[-1] = 0.0
    assert by_descriptor(rows, d, 0.5, 300).tolist() == [[299, 299]]


def test_no_pairs_are_no_matches():
    assert by_descriptor(np.empty((2, 0), np.int64), [], 1.0).shape == (0, 2)


@pytest.mark.parametrize('rows', [[[0, -1], [0, 0]], [[0, 300], [0, 0]], [[0, 1], [0, -1]],
                                  [[0, 1], [0, 40]], [[1, 0], [0, 0]], [[1, 0, 1], [0, 0, 0]]],
                         ids=str)
def test_rows_beyond_the_points_and_sources_out_of_order_are_rejected(rows):
    rows = np.array(rows)
    with pytest.raises(ValueError, match='^a row of a pair is not one of the points, or'):
        by_descriptor(rows, np.zeros(rows.shape[1]), 0.5)


@pytest.mark.parametrize('name, change, error', [
    ('rows', lambda rows: rows.astype(np.int32), TypeError),
    ('rows', lambda rows: rows[:, 1:].copy(), ValueError),
    ('target', lambda target: target[:, :3].copy(), ValueError),
    ('d_d', lambda d_d: d_d[:1], ValueError),
    ('d_d', lambda d_d: None, (TypeError, ValueError))])
def test_arrays_of_another_type_or_size_are_rejected(name, change, error):
    given = {'rows': np.array([[0, 1], [2, 3]]), 'd_d': np.zeros(2, np.float32),
             'source': points(5), 'target': points(6)}
    given[name] = change(given[name])
    with pytest.raises(error):
        Candidates(given['rows'], given['d_d']).closest(given['source'], given['target'], 0.5, 1.0)
