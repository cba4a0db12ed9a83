# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Transforms along chains of static and dynamic links, written out by hand."""

import itertools

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.frame_tree import FrameTree

SECOND = 10 ** 9


def pose(seed):
    return se3.exp(np.random.default_rng(seed).normal(0, 1, 6))


@pytest.fixture
def tree():
    tree = FrameTree()
    tree.set_static('mast', 'head', pose(1))
    tree.set_static('head', 'camera', pose(2))
    tree.set_static('base', 'wheel', pose(3))
    return tree


def test_down_a_chain_and_up_another(tree):
    tree.set_static('base', 'mast', pose(4))
    found = tree.find('wheel', 'camera', 0)
    np.testing.assert_allclose(
        found.T_target_source, np.linalg.inv(pose(3)) @ pose(4) @ pose(1) @ pose(2), atol=1e-9)
    assert found.is_static and found.gap == 0


def test_a_dynamic_link_is_interpolated(tree):
    """A mast that rotates about its axis at a constant rate."""
    for i in range(9):
        tree.add_sample('base', 'mast', (20 + i) * SECOND // 2, se3.exp([0, 0, 0, 0, 0, 0.1 * i]))
    found = tree.find('base', 'camera', round(12.3 * SECOND))
    np.testing.assert_allclose(found.T_target_source,
                               se3.exp([0, 0, 0, 0, 0, 0.46]) @ pose(1) @ pose(2), atol=1e-9)
    assert not found.is_static and found.gap == 0


@pytest.mark.parametrize('seconds, gap, nearest', [(14.5, 0.5, 0.8), (9.75, 0.25, 0.0)])
def test_outside_of_the_history_the_nearest_sample_is_taken(tree, seconds, gap, nearest):
    for i in range(5):
        tree.add_sample('base', 'mast', (10 + i) * SECOND, se3.exp([0, 0, 0, 0, 0, 0.2 * i]))
    found = tree.find('base', 'mast', round(seconds * SECOND))
    np.testing.assert_allclose(found.T_target_source, se3.exp([0, 0, 0, 0, 0, nearest]))
    assert found.gap == gap * SECOND


@pytest.mark.parametrize('rate', [0.05, 1, 100, 1000])
def test_the_last_ten_seconds_are_kept_at_any_rate(tree, rate):
    """A mast that rotates, sampled at a rate [Hz]: where that is low, by less than 0.1 deg."""
    period, turn_rate = round(SECOND / rate), 5e-5 if rate < 2 else 0.1
    for stamp in range(0, 20 * SECOND + period, period):
        tree.add_sample('base', 'mast', stamp,
                        se3.exp([0, 0, 0, 0, 0, turn_rate * stamp / SECOND]))
    for seconds in (10.0005, 15.6789, 19.9):
        found = tree.find('base', 'mast', round(seconds * SECOND))
        assert found.gap == 0
        np.testing.assert_allclose(found.T_target_source,
                                   se3.exp([0, 0, 0, 0, 0, turn_rate * seconds]), atol=1e-9)


def test_older_samples_are_dropped_and_their_number_is_bounded(tree):
    at_rest = pose(4)
    for stamp in range(0, 30 * SECOND, SECOND // 10):
        tree.add_sample('base', 'mast', stamp, at_rest)
    assert tree.find('base', 'mast', 0).gap == pytest.approx(20 * SECOND, abs=SECOND)
    for stamp in range(30 * SECOND, 30 * SECOND + 50_000):  # one per nanosecond
        tree.add_sample('base', 'mast', stamp, at_rest)
    # 20 000 of them: ten seconds at 2 kHz
    assert tree.find('base', 'mast', 30 * SECOND).gap == 30_000


def test_of_ever_new_frames_those_without_samples_for_long_are_forgotten(tree):
    """A publisher that gives each object it sees a frame of its own, beside a mast that turns."""
    count, at_rest = 12_000, pose(4)
    for i in range(count):
        if i % 1000 == 0:
            tree.add_sample('base', 'mast', i, at_rest)
        tree.add_sample('base', f'object_{i}', i, at_rest)
    known = [i for i in range(count) if tree.find('base', f'object_{i}', count)]
    assert known == list(range(count - 9_999, count))
    assert tree.find('base', 'mast', 0).gap == 0


def test_samples_that_are_not_newer_are_ignored(tree):
    for seconds, seed in ((10, 1), (11, 2), (10.5, 3), (11, 4)):
        tree.add_sample('base', 'mast', round(seconds * SECOND), pose(seed))
    for seconds in (11, 12):
        found = tree.find('base', 'mast', seconds * SECOND)
        np.testing.assert_allclose(found.T_target_source, pose(2))


@pytest.mark.parametrize('target, source', [('camera', 'wheel'), ('wheel', 'camera')])
def test_of_two_chains_the_larger_gap_counts(tree, target, source):
    tree.add_sample('base', 'mast', 10 * SECOND, pose(4))
    tree.set_static('axle', 'wheel', pose(3))
    tree.add_sample('world', 'base', 9 * SECOND, pose(5))
    tree.add_sample('world', 'axle', 11 * SECOND, pose(6))
    assert tree.find(target, source, 14 * SECOND).gap == 5 * SECOND


@pytest.mark.parametrize('seconds', [(9, 10, 11), (10, 9, 11), (11, 10, 9)])
def test_along_a_chain_the_largest_gap_counts(tree, seconds):
    links = zip(('world', 'base', 'mast'), ('base', 'mast', 'boom'), seconds)
    for seed, (parent, child, second) in enumerate(links):
        tree.add_sample(parent, child, second * SECOND, pose(seed))
    for target, source in (('world', 'boom'), ('boom', 'world')):
        assert tree.find(target, source, 14 * SECOND).gap == 5 * SECOND


def test_a_frame_on_another_parent_forgets_the_one_before(tree):
    tree.add_sample('base', 'mast', 10 * SECOND, pose(4))
    tree.add_sample('trailer', 'mast', 11 * SECOND, pose(5))
    assert tree.find('base', 'mast', 11 * SECOND) is None
    found = tree.find('trailer', 'mast', 10 * SECOND)
    np.testing.assert_allclose(found.T_target_source, pose(5))
    assert found.gap == SECOND


def test_a_clock_set_back_clears_the_history(tree):
    tree.add_sample('base', 'mast', 100 * SECOND, pose(4))
    tree.add_sample('base', 'mast', 10 * SECOND, pose(5))
    found = tree.find('base', 'mast', 10 * SECOND)
    np.testing.assert_allclose(found.T_target_source, pose(5))
    assert found.gap == 0


@pytest.mark.parametrize('back, is_restart', [(1.0, False), (1.001, True)])
def test_more_than_a_second_back_is_a_restart_however_long_the_history(tree, back, is_restart):
    for seconds in range(100, 106):
        tree.add_sample('base', 'mast', seconds * SECOND, pose(4))
    stamp = round((105 - back) * SECOND)
    tree.add_sample('base', 'mast', stamp, pose(5))
    found = tree.find('base', 'mast', stamp)
    np.testing.assert_allclose(found.T_target_source, pose(5 if is_restart else 4), atol=1e-9)


def test_unconnected_frames_have_no_transform(tree):
    assert tree.find('base', 'camera', 0) is None
    assert tree.find('base', 'elsewhere', 0) is None
    np.testing.assert_array_equal(tree.find('base', 'base', 0).T_target_source, np.eye(4))


def test_a_loop_of_frames_ends(tree):
    tree.set_static('base', 'mast', pose(4))
    tree.set_static('camera', 'base', pose(5))
    assert tree.find('elsewhere', 'camera', 0) is None
    assert tree.find('base', 'camera', 0) is not None


def test_a_sample_later_than_the_earlier_one_by_a_nanosecond_is_kept(tree):
    for stamp, seed in ((10, 1), (11, 2)):
        tree.add_sample('base', 'mast', stamp, pose(seed))
    np.testing.assert_allclose(tree.find('base', 'mast', 11).T_target_source, pose(2))


def test_dynamic_links_are_forgotten_and_static_ones_stay(tree):
    tree.add_sample('base', 'mast', 10, pose(4))
    tree.clear_dynamic()
    assert tree.find('base', 'mast', 10) is None
    np.testing.assert_allclose(tree.find('mast', 'head', 10).T_target_source, pose(1))


def test_of_a_frame_that_is_fixed_samples_do_not_count(tree):
    tree.add_sample('mast', 'head', 10, pose(4))
    found = tree.find('mast', 'head', 10)
    np.testing.assert_allclose(found.T_target_source, pose(1))
    assert found.is_static


def test_the_last_static_link_of_a_frame_counts(tree):
    tree.set_static('pole', 'head', pose(5))
    np.testing.assert_allclose(tree.find('pole', 'head', 0).T_target_source, pose(5))
    assert tree.find('mast', 'head', 0) is None


@pytest.mark.parametrize('target, source', [('camera', 'wheel'), ('wheel', 'camera')])
def test_a_chain_with_one_link_that_moves_is_not_static(tree, target, source):
    tree.add_sample('base', 'mast', 10, pose(4))
    assert not tree.find(target, source, 10).is_static
    tree.set_static('world', 'base', pose(5))
    assert not tree.find('world', 'camera', 10).is_static
    assert not tree.find('camera', 'world', 10).is_static
    assert tree.find('mast', 'camera', 10).is_static


def test_links_are_known_by_both_frames():
    tree = FrameTree()
    tree.set_static('base', 'camera', np.eye(4))
    tree.add_sample('base', 'arm', 0, np.eye(4))
    known = [('base', 'camera'), ('base', 'arm')]
    assert [names for names in itertools.product(('base', 'arm', 'camera'), repeat=2)
            if tree.has_link(*names)] == sorted(known, key=lambda names: names[1])


def resting(tree, *changes, period=SECOND):
    """Sample a mast that changes by 6 numbers, from one sample to the next."""
    pose = np.eye(4)
    tree.add_sample('base', 'mast', 0, pose)
    for i, change in enumerate(changes):
        pose = pose @ se3.exp(change)
        tree.add_sample('base', 'mast', (i + 1) * period, pose)
    return len(changes) * period


STILL = [0.0] * 6


@pytest.mark.parametrize('change, is_rest', [
    (STILL, True), ([0.9e-3, 0, 0, 0, 0, 0], True), ([0, 1.1e-3, 0, 0, 0, 0], False),
    ([0, 0, 0, 0, 0, np.radians(0.099)], True), ([0, 0, 0, np.radians(-0.101), 0, 0], False)])
def test_a_link_rests_within_a_millimetre_and_a_tenth_of_a_degree(tree, change, is_rest):
    last = resting(tree, change, period=SECOND // 2)
    assert tree.find('base', 'mast', last + 1).has_rested is is_rest
    assert tree.find('base', 'mast', last).has_rested  # known, wherever it moves
    assert tree.find('base', 'mast', last // 2).has_rested


def test_a_link_that_creeps_does_not_rest(tree):
    """By 0.3 mm a sample: after four of them it is elsewhere."""
    last = resting(tree, *7 * [[0.3e-3, 0, 0, 0, 0, 0]])
    assert tree.find('base', 'mast', last + 3 * SECOND).has_rested
    assert not tree.find('base', 'mast', last + 4 * SECOND).has_rested


def test_a_link_that_trembles_about_a_place_rests(tree):
    last = resting(tree, *10 * [[0.8e-3, 0, 0, 0, 0, 0], [-0.8e-3, 0, 0, 0, 0, 0]])
    assert tree.find('base', 'mast', 2 * last).has_rested
    assert not tree.find('base', 'mast', 2 * last + 1).has_rested


def test_before_the_first_sample_a_link_is_never_known(tree):
    resting(tree, STILL, STILL)
    found = tree.find('base', 'mast', -1)
    assert (found.is_past, found.has_rested, found.gap) == (True, False, 1)
    for stamp in (0, 1, 5 * SECOND):
        assert not tree.find('base', 'mast', stamp).is_past


MOVES = [0.3, 0, 0, 0, 0, 0]


@pytest.mark.parametrize('stamp, gap, nearest', [
    (0, 0, 0.0), (1, 1, 0.0), (1_500_000_000, 1_500_000_000, 0.0),
    (1_500_000_001, 1_499_999_999, 0.3), (2_900_000_000, 100_000_000, 0.3),
    (3_000_000_000, 0, 0.3)])
def test_what_a_link_did_in_a_hole_of_its_samples_is_not_known(tree, stamp, gap, nearest):
    resting(tree, MOVES, period=3 * SECOND)
    found = tree.find('base', 'mast', stamp)
    assert (found.gap, found.has_rested, found.is_past) == (gap, gap == 0, gap > 0)
    assert found.T_target_source[0, 3] == pytest.approx(nearest)


@pytest.mark.parametrize('change, period, is_known', [
    (MOVES, SECOND // 2, True), (MOVES, SECOND // 2 + 2, False), (STILL, 9 * SECOND, True),
    ([0.9e-3, 0, 0, 0, 0, 0], 9 * SECOND, True), ([1.1e-3, 0, 0, 0, 0, 0], 9 * SECOND, False)])
def test_a_hole_is_longer_than_half_a_second_and_the_link_elsewhere_after_it(
        tree, change, period, is_known):
    resting(tree, change, period=period)
    found = tree.find('base', 'mast', period // 2)
    assert (found.gap == 0) is found.has_rested is is_known
    if is_known:
        assert found.T_target_source[0, 3] == pytest.approx(change[0] / 2)


@pytest.mark.parametrize('target, source', [('base', 'boom'), ('boom', 'base')])
def test_a_chain_rests_where_each_of_its_links_does(tree, target, source):
    resting(tree, STILL)
    tree.add_sample('mast', 'boom', 0, pose(4))
    tree.add_sample('mast', 'boom', SECOND, pose(5))
    assert not tree.find(target, source, SECOND + 1).has_rested
    assert tree.find('base', 'mast', SECOND + 1).has_rested
    tree.add_sample('mast', 'boom', 2 * SECOND, pose(5))
    assert tree.find(target, source, 2 * SECOND).has_rested
    assert tree.find(target, source, -1).is_past
