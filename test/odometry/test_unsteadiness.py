# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tests of the errors of velocities at frames."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.unsteadiness import Unsteadiness
from aick_ros.registration.prediction import Prediction

PERIOD = 0.1
RNG = np.random.default_rng


def learned(twists, intervals, skipped=()):
    """Return what increments show; some are of another camera and do not count."""
    unsteadiness, stamp = Unsteadiness(), 10 * NANOSECONDS
    for i, (twist, interval) in enumerate(zip(twists, intervals)):
        stamp += round(interval * NANOSECONDS)
        if i not in skipped:
            increment = Increment(PoseWithCovariance(se3.exp(interval * twist)), interval)
            unsteadiness.learn(increment, stamp)
    return unsteadiness.squares


def of_means(velocity, times):
    """Return the mean velocities in the intervals between times, and the velocities at them."""
    means = [np.mean([velocity(t) for t in np.linspace(*ends, 200)], 0)
             for ends in zip(times, times[1:])]
    return np.array(means), np.array([velocity(t) for t in times[1:]])


def test_a_steady_velocity_has_no_error():
    np.testing.assert_allclose(learned(np.tile(RNG(1).normal(0, 1, 6), (5, 1)), [PERIOD] * 5),
                               0.0, atol=1e-15)


@pytest.mark.parametrize('count', [0, 1, 2])
def test_three_increments_in_a_row_are_needed(count):
    assert learned(RNG(1).normal(0, 1, (count, 6)), [PERIOD] * count) is None
    assert learned(RNG(1).normal(0, 1, (5, 6)), [PERIOD] * 5, skipped=[2]) is None


@pytest.mark.parametrize('intervals', [[PERIOD] * 200, [PERIOD, PERIOD, 2 * PERIOD] * 60])
def test_they_are_about_what_predicted_velocities_err_by(intervals):
    """For each axis, of a motion with the frequencies of a hand, with frames missing or not."""
    sizes, phases = np.array([0.3, 0.1, 0.2, 0.5, 0.9, 0.4]), RNG(2).uniform(0, 6, (2, 6))

    def velocity(time):
        return sizes * (np.sin(5.0 * time + phases[0]) + np.sin(7.7 * time + phases[1]))

    means, truth = of_means(velocity, np.cumsum([0.0, *intervals]))
    errors = []
    for before, mean, at_end, interval in zip(means, means[1:], truth[1:], intervals[1:]):
        predicted = Prediction(se3.exp(interval * before), before, interval).twist_with(
            se3.exp(interval * mean))
        errors.append(np.square(predicted - at_end) / interval ** 2)
    found = learned(means[-32:], intervals[-32:])
    ratio = np.mean(errors[-31:], 0) / found
    assert (ratio > 0.4).all() and (ratio < 2.5).all()


def test_the_last_thirty_count():
    rng, count = RNG(3), 400
    calm, shaken = rng.normal(0, [[0.01], [1.0]], (2, count))[:, :, None] * np.ones(6)
    before, after = (learned(np.vstack(each), [PERIOD] * 2 * count)
                     for each in ((shaken, calm), (calm, shaken)))
    assert (1e3 * before < after).all()
