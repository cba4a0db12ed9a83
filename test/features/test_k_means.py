# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Visual words against simulated clusters, and against the condition of convergence."""

import itertools

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.features.descriptors import descriptor_distances
from aick_ros.features.k_means import _seeds, _squared_distances, learn_words


def clusters(binary, count=12, size=60, seed=0):
    """Return cluster centres and noisy descriptors of each."""
    rng = np.random.default_rng(seed)
    if binary:
        centres = rng.integers(0, 256, (count, 32), dtype=np.uint8)
        bits = np.unpackbits(np.repeat(centres, size, axis=0), axis=1)
        members = np.packbits(bits ^ (rng.random(bits.shape) < 0.05), axis=1)
    else:
        centres = rng.normal(0, 1, (count, 64)).astype(np.float32)
        members = np.repeat(centres, size, axis=0)
        members = members + rng.normal(0, 0.05, members.shape).astype(np.float32)
    return centres, members[rng.permutation(len(members))]


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('seed', range(3))
def test_simulated_clusters_are_found(binary, seed):
    """With more words than clusters, because k-means finds a local optimum only."""
    centres, descriptors = clusters(binary, seed=seed)
    distances = descriptor_distances(centres, learn_words(descriptors, 2 * len(centres), seed))
    assert distances.min(axis=1).max() < 0.02


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
def test_words_are_the_centres_of_their_clusters(binary):
    """The fixed point of k-means and of k-majority, checked with plain loops."""
    _, descriptors = clusters(binary, count=5, size=40)
    words = learn_words(descriptors, 8, rounds=200)
    members = descriptor_distances(descriptors, words).argmin(axis=1)
    for word, centre in enumerate(words):
        mine = descriptors[members == word]
        assert len(mine) > 0
        if binary:
            bits = np.unpackbits(mine, axis=1)
            expected = [int(2 * sum(column) > len(mine)) for column in bits.T.tolist()]
            assert np.unpackbits(centre).tolist() == expected
        else:
            np.testing.assert_allclose(centre, mine.mean(axis=0), atol=1e-5)


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
def test_the_result_depends_on_the_seed_only(binary):
    _, descriptors = clusters(binary)
    words = [learn_words(descriptors, 30, seed, rounds=3) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(words[0], words[1])
    assert not np.array_equal(words[0], words[2])


def test_progress_is_reported_after_each_round():
    reported = []
    learn_words(clusters(True)[1], 100, rounds=4, progress=reported.append)
    assert reported == list(range(1, len(reported) + 1))
    assert 1 <= len(reported) <= 4


def test_as_many_words_as_descriptors_are_the_descriptors():
    descriptors = clusters(True, count=4, size=5)[1]
    words = learn_words(np.concatenate([descriptors, descriptors]), len(descriptors))
    assert set(map(bytes, words)) == set(map(bytes, descriptors))


def test_too_few_descriptors_are_rejected():
    same = np.zeros((50, 32), np.uint8)
    with pytest.raises(InputError, match='50 descriptors, 1 of them different, are too few for 2 '
                                         'words: take more frames or fewer words'):
        learn_words(same, 2)
    with pytest.raises(InputError, match='0 descriptors'):
        learn_words(same[:0], 2)


@pytest.mark.parametrize('rounds', [1, 2, 5])
def test_there_are_as_many_rounds_as_asked_for(rounds):
    """On noise, which takes long to converge; the default is another number."""
    descriptors = np.random.default_rng(0).normal(0, 1, (3000, 8)).astype(np.float32)
    reported = []
    learn_words(descriptors, 40, rounds=rounds, progress=reported.append)
    assert reported == list(range(1, rounds + 1))


def test_more_rounds_than_it_takes_are_not_made():
    _, descriptors = clusters(False, count=3, size=20)
    reported = []
    learn_words(descriptors, 3, rounds=100, progress=reported.append)
    assert 1 < len(reported) < 20


def test_bits_that_are_set_in_half_of_a_cluster_are_not_set_in_its_word():
    descriptors = np.array([[0b1100], [0b1010], [0b1100], [0b1010]], np.uint8)
    assert learn_words(descriptors, 1).tolist() == [[0b1000]]


def test_an_empty_cluster_moves_to_the_descriptor_farthest_from_its_word():
    """Two seeds that are equal for the k-means: one of two far groups has no word at first."""
    rng = np.random.default_rng(1)
    near = rng.normal(0, 0.01, (500, 4)).astype(np.float32)
    far = np.full((1, 4), 50.0, np.float32)
    words = learn_words(np.concatenate([near, far]), 2)
    assert np.abs(words - far).max(axis=1).min() < 1e-4


def test_seeds_are_drawn_in_proportion_to_their_squared_distances():
    """
    k-means++ (Arthur and Vassilvitskii 2007), of three points on a line and two seeds.

    The first seed is any of them; in closed form, the second one is by its squared distance.
    """
    points = np.array([[0.0], [1.0], [3.0]], np.float32)
    counts = np.zeros((3, 3))
    for seed in range(3000):
        first, second = _seeds(points, 2, np.random.default_rng(seed))[:, 0]
        counts[points[:, 0].tolist().index(first), points[:, 0].tolist().index(second)] += 1
    squares = (points - points.T) ** 2
    expected = squares / squares.sum(axis=1, keepdims=True) / 3
    np.testing.assert_allclose(counts / 3000, expected, atol=0.04)


def test_the_third_seed_is_drawn_by_the_distance_to_the_nearer_of_two():
    """Of four points on a line: the odds of each order of three, in closed form."""
    line = [0.0, 1.0, 10.0, 14.0]
    drawn = [tuple(_seeds(np.array(line, np.float32)[:, None], 3, np.random.default_rng(seed))
                   [:, 0].tolist()) for seed in range(3000)]
    for order in itertools.permutations(line, 3):
        probability = 0.25
        for i in (1, 2):
            weights = {x: min((x - seed) ** 2 for seed in order[:i]) for x in line}
            probability *= weights[order[i]] / sum(weights.values())
        assert drawn.count(order) / 3000 == pytest.approx(probability, abs=0.03)


def test_distances_from_one_of_the_points_are_squared_and_zero_to_itself():
    points = np.random.default_rng(2).normal(0, 1, (30, 7)).astype(np.float32)
    expected = np.square(points - points[11]).sum(axis=1)
    found = _squared_distances(points, 11)
    np.testing.assert_allclose(found, expected, atol=1e-5)
    assert found[11] == 0.0
