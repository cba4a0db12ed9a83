# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The motion model against an integrated path, sampled accelerations and its limits."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.settings import OdometrySettings

TWIST = np.array([0.4, -0.2, 0.3, 0.5, -0.8, 0.2])


@pytest.mark.parametrize('elapsed, moving', [(0.2, 0.2), (0.3, 0.3), (5.0, 0.3)])
def test_the_velocity_is_held_and_then_the_camera_stands_still(elapsed, moving):
    """The oracle integrates the path in small steps of body velocity."""
    T, steps = np.eye(4), 20000
    for _ in range(steps):
        T[:3, 3] += T[:3, :3] @ TWIST[:3] * moving / steps
        T[:3, :3] = T[:3, :3] @ (np.eye(3) + se3.skew(TWIST[3:] * moving / steps))
    predicted = MotionModel(OdometrySettings(hold_time=0.3)).predict(TWIST, elapsed)
    np.testing.assert_allclose(predicted.matrix, T, atol=1e-4)


def test_the_velocity_counts_for_the_hold_time():
    model = MotionModel(OdometrySettings(hold_time=0.3))
    assert [model.holds(elapsed) for elapsed in (0.1, 0.3, 0.31)] == [True, True, False]


def test_a_velocity_that_was_never_measured_may_be_any_within_the_limits():
    """They are three of its standard deviations, beside those of an acceleration."""
    model = MotionModel(OdometrySettings(
        max_speed=1.5, max_turn_rate=6.0, acceleration_sigma=4.0, angular_acceleration_sigma=20.0))
    predicted = model.predict(None, 0.1)
    assert np.sqrt(predicted.covariance[0, 0]) == pytest.approx(
        np.hypot(0.1 * model.unknown_speed, 0.005 * model._acceleration_sigma))
    np.testing.assert_array_equal(predicted.matrix, np.eye(4))
    sigmas = np.hypot([0.05, 0.2], [0.02, 0.1])
    np.testing.assert_allclose(np.sqrt(np.diag(predicted.covariance)), np.repeat(sigmas, 3))
    assert (np.diag(model.predict(np.zeros(6), 0.1).covariance) < 0.3 * np.repeat(
        sigmas ** 2, 3)).all()


def test_the_covariance_is_that_of_sampled_accelerations():
    """Each sample integrates a constant acceleration twice, axis by axis."""
    settings = OdometrySettings(acceleration_sigma=2.0, angular_acceleration_sigma=7.0)
    elapsed, steps = 0.2, 400
    sigmas = np.repeat([2.0, 7.0], 3)
    accelerations = np.random.default_rng(1).normal(0.0, sigmas, (40000, 6))
    velocity, position = np.zeros((2, *accelerations.shape))
    for _ in range(steps):
        velocity += accelerations * elapsed / steps
        position += velocity * elapsed / steps
    covariance = MotionModel(settings).predict(TWIST, elapsed).covariance
    np.testing.assert_allclose(covariance, np.cov(position.T), atol=0.03 * covariance.max())
    np.testing.assert_allclose(np.diag(covariance), position.var(axis=0), rtol=0.04)


def test_the_covariance_ends_at_the_speed_limit_and_half_a_turn():
    covariance = MotionModel(OdometrySettings(max_speed=2.0)).predict(TWIST, 60.0).covariance
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [120, 120, 120, *3 * [np.pi]])


@pytest.mark.parametrize('interval', [0.4, 0.7, 1.5])
def test_the_velocity_at_the_end_differs_from_the_mean_as_that_of_sampled_accelerations(interval):
    """The velocity is held for 0.3 s, and an acceleration changes it from then on."""
    settings = OdometrySettings(hold_time=0.3, acceleration_sigma=2.0,
                                angular_acceleration_sigma=3.0, max_speed=100.0,
                                max_turn_rate=100.0)
    sigmas = np.repeat([2.0, 3.0], 3)
    times = (np.arange(10_000) + 0.5) * interval / 10_000
    accelerated = np.maximum(times - 0.3, 0.0)
    change = (interval - 0.3 - accelerated.mean()) * sigmas
    np.testing.assert_allclose(MotionModel(settings).change_of_twist(interval),
                               np.diag(change ** 2), rtol=1e-3)


@pytest.mark.parametrize('interval', [0.001, 1 / 30, 0.3])
def test_within_the_hold_time_the_velocity_is_the_mean(interval):
    model = MotionModel(OdometrySettings(hold_time=0.3))
    np.testing.assert_array_equal(model.change_of_twist(interval), np.zeros((6, 6)))


def test_the_velocity_changes_by_no_more_than_the_limits_of_speed():
    model = MotionModel(OdometrySettings(max_speed=2.0, max_turn_rate=3.0))
    np.testing.assert_allclose(np.diag(model.change_of_twist(10.0)), [4, 4, 4, 9, 9, 9])


def test_a_velocity_never_measured_changes_by_the_acceleration_or_from_rest():
    """Of 3 m/s^2 along each axis in 0.1 s, and of 0.5 rad/s from rest."""
    model = MotionModel(OdometrySettings(acceleration_sigma=3.0, angular_acceleration_sigma=15.0))
    twist = np.array([0.0, -2.0, 0.0, 0.3, 0.0, 0.4])
    increment = Increment(PoseWithCovariance(se3.exp(0.1 * twist)), 0.1)
    np.testing.assert_allclose(model.changes_unseen(increment), [3 * 0.3 ** 2, 0.5 ** 2])


def test_a_camera_at_rest_has_changed_no_velocity():
    increment = Increment(PoseWithCovariance(np.eye(4)), 0.1)
    assert not MotionModel(OdometrySettings()).changes_unseen(increment).any()


@pytest.mark.parametrize('speed, turn_rate, exceeds', [
    (1.9, 0.9, False), (2.1, 0.0, True), (0.0, 1.1, True)])
@pytest.mark.parametrize('interval', [0.1, 0.5])
def test_increments_beyond_a_limit_are_named(speed, turn_rate, exceeds, interval):
    model = MotionModel(OdometrySettings(max_speed=2.0, max_turn_rate=1.0))
    turn = se3.exp_rotation(interval * turn_rate * np.array([0.6, 0.0, 0.8]))
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, interval * speed * np.array([0.0, 0.8, -0.6])
    violation = model.violation(Increment(PoseWithCovariance(motion), interval))
    if exceeds:
        assert violation == (f'{speed:.2f} m/s and {turn_rate:.2f} rad/s, odometry.max_speed is 2 '
                             'and odometry.max_turn_rate 1')
    else:
        assert violation is None


def test_increments_at_a_limit_are_within_it():
    turn = se3.exp_rotation([0.0, 0.25, 0.0])
    model = MotionModel(OdometrySettings(max_speed=2.0, max_turn_rate=se3.angle(turn) / 0.5))
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = turn, (0.0, 0.0, 1.0)
    assert model.violation(Increment(PoseWithCovariance(motion), 0.5)) is None


@pytest.mark.parametrize('twist, seconds', [
    (None, 0.3 + 2.7 / 3 / 3.0), ([0.6, 0, 0, 0, 0, 0], 0.5), ([-0.6, 0, 0, 0, 0, 6.0], 0.7),
    ([0, -0.6, 0, 0, 0, 0], 0.5), ([0, 0, 0, 0, -3.0, 0], 0.5)])
def test_the_time_to_rest_is_that_to_stop_after_the_hold_time(twist, seconds):
    """
    0.6 m/s at 3 m/s^2 stop in 0.2 s, 6 rad/s at 15 rad/s^2 in 0.4 s.

    A velocity that was never measured is within three standard deviations of the limits.
    """
    model = MotionModel(OdometrySettings(
        hold_time=0.3, max_speed=2.7, acceleration_sigma=3.0, angular_acceleration_sigma=15.0))
    assert model.time_to_rest(None if twist is None else np.array(twist)) == pytest.approx(seconds)


def test_a_velocity_that_depth_alone_observed_counts_by_its_share_of_the_information():
    """Past the hold time: of prior p and error c a velocity v leaves v p / (p + c)."""
    model = MotionModel(OdometrySettings(hold_time=0.3, acceleration_sigma=2.0,
                                         angular_acceleration_sigma=4.0))
    unconfirmed, twist = 0.5, np.array([0.3, -0.2, 0.1, 0.4, -0.5, 0.6])
    prior = np.square(0.5 * unconfirmed ** 2 * np.repeat([2.0, 4.0], 3))
    errors = prior * np.array([1e-6, 1.0, 1e6, 1e-6, 3.0, 1e6])
    increment = Increment(PoseWithCovariance(se3.exp(0.1 * twist), np.diag(errors)), 0.1)
    np.testing.assert_allclose(model.observed_twist(increment, unconfirmed),
                               twist * prior / (prior + errors), rtol=1e-6)
    np.testing.assert_allclose(model.observed_twist(increment, 0.2), twist, rtol=1e-9)
