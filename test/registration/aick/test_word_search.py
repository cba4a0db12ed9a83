# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The search by words against the full one, and against the paper's words with plain loops."""

import dataclasses

import numpy as np
import pytest

from aick_ros.features.descriptors import descriptor_distances
from aick_ros.features.vocabulary import Vocabulary
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import se3
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.aick.word_search import WordSearch
from aick_ros.registration.status import Status
from aick_ros.settings import AickSettings

SETTINGS = AickSettings(lambda_e=0.05)


def two_views(seed, binary, count=120):
    """Two noisy views of random points, half of which look like each other."""
    rng = np.random.default_rng(seed)
    positions = rng.uniform((-1, -1, 1), (1, 1, 3), (count, 3))
    T = se3.exp(np.r_[rng.normal(0, 0.1, 3), rng.normal(0, 0.2, 3)])
    moved = se3.transform(T, positions) + rng.normal(0, 0.002, (count, 3))
    if binary:
        kinds = rng.integers(0, 256, (count // 2, 32), dtype=np.uint8)
        views = [np.packbits(np.unpackbits(kinds[np.arange(count) % len(kinds)], axis=1)
                             ^ (rng.random((count, 256)) < 0.05), axis=1) for _ in range(2)]
    else:
        kinds = rng.normal(0, 1, (count // 2, 64))
        views = [kinds[np.arange(count) % len(kinds)] + rng.normal(0, 0.15, (count, 64))
                 for _ in range(2)]
        views = [np.float32(view / np.linalg.norm(view, axis=1, keepdims=True)) for view in views]
    order = rng.permutation(count)
    return frame(positions, views[0]), frame(moved[order], views[1][order])


def frame(positions, descriptors, words=None):
    count = len(positions)
    return KeypointFrame(0, np.asarray(positions, np.float32), descriptors,
                         np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)),
                         np.zeros((count, 2), np.float32), words)


def with_words(views, count, radius, seed=0):
    """Give two views words: the descriptors of some keypoints, and of none."""
    rng = np.random.default_rng(seed)
    descriptors = np.concatenate([view.descriptors for view in views])
    words = descriptors[rng.permutation(len(descriptors))[:count]]
    vocabulary = Vocabulary('random', words)
    return [dataclasses.replace(view, words=vocabulary.words_of(view.descriptors, radius))
            for view in views]


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'float'])
@pytest.mark.parametrize('count', [1, 7, 60])
@pytest.mark.parametrize('seed', range(4))
def test_an_infinite_radius_gives_exactly_the_full_search(binary, count, seed):
    views = two_views(seed, binary)
    for settings in (SETTINGS, AickSettings(alpha=0.3, iterations=5), AickSettings(alpha=0.8)):
        full = Aick(settings).register(*views)
        by_words = Aick(settings).register(*with_words(views, count, np.inf, seed))
        assert (by_words.status, by_words.iterations) == (full.status, full.iterations)
        np.testing.assert_array_equal(by_words.matches, full.matches)
        np.testing.assert_array_equal(by_words.T_target_source, full.T_target_source)


@pytest.mark.parametrize('binary, radius', [(True, 0.15), (True, 0.45), (False, 0.3),
                                            (False, 1.9)])
@pytest.mark.parametrize('seed', [1, 2])
def test_agrees_with_the_paper_match_for_match(binary, radius, seed):
    """III-B with plain loops: a keypoint's closest word, and who has it in Psi."""
    views = source, target = with_words(two_views(seed, binary), 40, radius)
    words = source.words.vocabulary.words
    to_words = [descriptor_distances(view.descriptors, words) for view in views]
    search, T = WordSearch(source, target, SETTINGS), np.eye(4)
    for w in (1.0, 0.6, 0.36, 0.2, 0.1, 0.02, 0.0, 0.3):
        threshold = (1 - w) * SETTINGS.lambda_e + w * SETTINGS.lambda_f
        moved, expected = se3.transform(T, source.positions), []
        for a in range(len(source)):
            word = to_words[0][a].argmin()
            best, least = None, threshold
            for b in np.flatnonzero(to_words[1][:, word] < radius):
                d_d = descriptor_distances(source.descriptors[a:a + 1],
                                           target.descriptors[b:b + 1])[0, 0]
                d = (1 - w) * np.linalg.norm(moved[a] - target.positions[b]) + w * d_d
                if d < least:
                    best, least = b, d
            if best is not None:
                expected.append((a, best))
        assert [tuple(match) for match in search.closest(T, w)] == expected
        T = T @ se3.exp((0.01, -0.01, 0.02, 0.01, 0.0, -0.01))


def test_fewer_than_three_candidates_are_too_few_matches():
    views = two_views(0, binary=True)
    found = Aick(SETTINGS).register(*with_words(views, 2, 0.0))
    assert found.status is Status.TOO_FEW_MATCHES
    assert '0 matches in iteration 0' in found.reason


def test_frames_without_keypoints_have_words_too():
    nothing = frame(np.empty((0, 3)), np.empty((0, 32), np.uint8))
    views = with_words([nothing, two_views(0, binary=True)[0]], 5, 0.3)
    assert Aick(SETTINGS).register(*views).status is Status.TOO_FEW_KEYPOINTS


def test_words_of_two_vocabularies_are_not_compared():
    views = two_views(0, binary=True)
    mixed = with_words(views, 5, 0.1)[0], with_words(views, 5, 0.1)[1]
    np.testing.assert_array_equal(Aick(SETTINGS).register(*mixed).matches,
                                  Aick(SETTINGS).register(*views).matches)


@pytest.mark.parametrize('lambda_e', [0.5, 3.0])
def test_by_position_all_pairs_within_the_threshold_are_compared(lambda_e):
    """Where one word is all, what is nearest is, whatever its descriptor and the unit."""
    views = with_words([frame(3 * view.positions, view.descriptors)
                        for view in two_views(4, binary=True)], 1, 1.0)
    found = WordSearch(*views, AickSettings(lambda_e=lambda_e)).closest(
        se3.exp([0.8, 0, 0, 0, 0, 0]), 0.0)
    moved = views[0].positions + np.float32([0.8, 0, 0])
    distances = np.linalg.norm(moved[:, None] - views[1].positions, axis=2)
    nearest = np.column_stack([np.arange(len(moved)), distances.argmin(axis=1)])
    np.testing.assert_array_equal(found, nearest[distances.min(axis=1) < lambda_e])
    assert distances.min(axis=1).max() > 1.2


@pytest.mark.parametrize('without', [0, 1])
def test_both_frames_need_words(without):
    views = with_words(two_views(0, binary=True), 5, 0.3)
    views[without] = dataclasses.replace(views[without], words=None)
    with pytest.raises(ValueError, match='^a search by words requires the words of both frames$'):
        WordSearch(*views, SETTINGS)
    assert Aick(SETTINGS).register(*views).status is Status.OK  # by the full search
