# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tests of the change of a velocity by its changes over several intervals, beside any noise."""

import numpy as np
import pytest

from aick_ros.odometry.lagged_change import LaggedChange

RATE = 30.0
UNKNOWN = np.full(2, 1e3)  # standard deviation of another mean that says nothing


def lagged(twists, times=None):
    """Return what has taken some velocities, n x 6, in turn."""
    change = LaggedChange()
    for each in zip(np.arange(len(twists)) / RATE if times is None else times, twists):
        change.add(*each)
    return change


def swing(count, frequency=2.0, rate=RATE):
    """Return velocities of a hand that swings, n x 6."""
    phases = 2 * np.pi * frequency * np.arange(count)[:, None] / rate + np.arange(6)
    return np.sin(phases) * [0.2, 0.2, 0.2, 0.8, 0.8, 0.8]


def true_change(twists):
    return np.square(np.diff(twists, axis=0)).sum(0).reshape(2, 3).sum(1) / (len(twists) - 1)


@pytest.mark.parametrize('frequency', [1.0, 3.0])
def test_the_change_of_a_swing_is_found(frequency):
    twists = swing(200, frequency)
    found = lagged(twists).combined(np.zeros(2), UNKNOWN)
    assert (found > 0.9 * true_change(twists)).all()
    assert (found < 1.5 * true_change(twists)).all()


@pytest.mark.parametrize('sigma', [0.02, 0.05])
@pytest.mark.parametrize('of_poses', [False, True])
def test_the_change_is_found_beside_noise_that_is_larger(of_poses, sigma):
    """Noise of each velocity, or of the poses that it is the difference of; without the floor."""
    rng, twists = np.random.default_rng(1), swing(3000)
    noise = rng.normal(0, sigma, (3001, 6)) * [1, 1, 1, 4, 4, 4]
    noisy = twists + (np.diff(noise, axis=0) if of_poses else noise[1:])
    found = np.mean([lagged(noisy[first:first + 60])._mean for first in range(0, 3000, 60)], 0)
    true = true_change(twists)
    assert (0.7 * true < found).all() and (found < 1.6 * true).all()


def test_noise_alone_is_little_change():
    rng = np.random.default_rng(1)
    noisy = rng.normal(0, 0.3, (60, 6))
    assert (lagged(noisy).combined(np.zeros(2), UNKNOWN) < 0.08 * true_change(noisy)).all()


def test_unequal_intervals_are_not_compared():
    """As where frames are missing: the change over them is not in proportion to their number."""
    times = np.cumsum(np.tile([1, 2, 1, 1, 3], 40)) / RATE
    found = lagged(swing(200), times).combined(np.array([1.0, 2.0]), UNKNOWN)
    np.testing.assert_array_equal(found, [1.0, 2.0])


def test_at_a_low_rate_another_mean_holds():
    """The change over two intervals of 0.1 s is none of one over 0.1 s."""
    found = lagged(swing(100), np.arange(100) / 10.0).combined(np.array([1.0, 2.0]), UNKNOWN)
    np.testing.assert_array_equal(found, [1.0, 2.0])


def test_few_changes_count_nothing():
    twists = swing(12)
    np.testing.assert_array_equal(
        lagged(twists).combined(np.array([1.0, 2.0]), UNKNOWN), [1.0, 2.0])
    assert (lagged(swing(13)).combined(np.array([1.0, 2.0]), UNKNOWN) != [1.0, 2.0]).all()


def test_a_mean_that_is_certain_holds():
    found = lagged(swing(100)).combined(np.array([1.0, 2.0]), np.zeros(2))
    np.testing.assert_array_equal(found, [1.0, 2.0])


def test_velocities_of_before_a_break_are_compared_with_none():
    """What was learned of the changes stays."""
    change = lagged(swing(100))
    before = change.combined(np.zeros(2), UNKNOWN)
    change.restart()
    for index in range(2):
        change.add(4.0 + index / RATE, np.full(6, 100.0))
    np.testing.assert_array_equal(change.combined(np.zeros(2), UNKNOWN), before)


def test_a_camera_at_rest_does_not_change():
    np.testing.assert_array_equal(
        lagged(np.zeros((50, 6))).combined(np.zeros(2), np.zeros(2)), 0.0)
