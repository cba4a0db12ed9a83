# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Gravity and bias of a camera whose motion, noise and truth are known."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.odometry.inertial.force_integral import Impulse
from aick_ros.odometry.inertial.gravity_filter import GRAVITY, GravityFilter
from aick_ros.settings import ImuSettings

STEP = 1 / 15  # s
SETTINGS = ImuSettings(accelerometer_bias_walk=0.0)
POSITION_SIGMA, ORIENTATION_SIGMA = 0.002, 1e-4
FIRST_SIGMA = 0.5  # m/s^2


def orientation(time):
    return se3.exp_rotation([0.5 * np.sin(1.3 * time), 0.4 * np.sin(0.9 * time), 0.6 * time])


def follow(rng, count=75, sudden=(), first_sigma=FIRST_SIGMA):
    """Return a filter after some frames, and the true gravity and bias."""
    gravity = GRAVITY * se3.exp_rotation([0.3, -0.2, 0]) @ [0, 0, 1]
    bias = SETTINGS.accelerometer_bias_sigma * rng.standard_normal(3)
    position, velocity = np.zeros(3), rng.uniform(-0.5, 0.5, 3)

    def measured():
        return position + POSITION_SIGMA * rng.standard_normal(3)

    covariance = POSITION_SIGMA ** 2 * np.eye(3)
    estimate = GravityFilter(SETTINGS, gravity + first_sigma * rng.standard_normal(3),
                             first_sigma ** 2 * np.eye(3), measured(), covariance)
    agreed = []
    for index in range(count):
        turn = orientation(STEP * (index + 0.5))
        acceleration = np.array([np.sin(2.0 * STEP * index), np.cos(3.0 * STEP * index), 0.3])
        noise = SETTINGS.accelerometer_noise / np.sqrt(STEP) * rng.standard_normal(3)
        force = acceleration + gravity + turn @ bias + noise
        position = position + STEP * velocity + 0.5 * STEP ** 2 * acceleration
        velocity = velocity + STEP * acceleration
        estimate.predict(Impulse(STEP, STEP * force, 0.5 * STEP ** 2 * force, STEP * turn,
                                 0.5 * STEP ** 2 * turn), ORIENTATION_SIGMA ** 2 * np.eye(3))
        agreed.append(estimate.measure(measured() + (0.3 if index in sudden else 0), covariance))
    return estimate, gravity, bias, agreed


def test_errors_are_as_large_as_their_covariance():
    squared = []
    for seed in range(12):
        estimate, gravity, bias, agreed = follow(np.random.default_rng(seed))
        assert np.mean(agreed) > 0.95
        error = np.concatenate([estimate.gravity - gravity, estimate.bias - bias])
        squared.append(error @ np.linalg.solve(estimate.covariance[6:, 6:], error))
    assert 3.0 < np.mean(squared) < 10.0  # of six; 0.1 % to 99.9 % of the mean of 12: 3.5 to 9.4


def test_the_noise_of_a_force_moves_the_camera_as_long_as_it_lasts():
    """White noise n over t: a force of variance n^2 / t, constant over it, as in the impulse."""
    time, noise, covariances = 0.1, 0.3, []
    for density in (1e-6, noise):
        settings = ImuSettings(accelerometer_noise=density)
        estimate = GravityFilter(settings, np.array([0, 0, GRAVITY]), 1e-4 * np.eye(3),
                                 np.zeros(3), 1e-6 * np.eye(3))
        estimate.predict(Impulse(time, np.zeros(3), np.zeros(3), time * np.eye(3),
                                 0.5 * time ** 2 * np.eye(3)), np.zeros((3, 3)))
        covariances.append(estimate.covariance)
    by_force = np.kron([[0.5 * time ** 2], [time], [0.0], [0.0]], np.eye(3))
    np.testing.assert_allclose(covariances[1] - covariances[0],
                               noise ** 2 / time * by_force @ by_force.T, atol=1e-12)


def test_five_seconds_tell_gravity_from_motion_and_bias():
    estimate, gravity, bias, _ = follow(np.random.default_rng(1))
    angle = np.degrees(np.arccos(estimate.up.vector @ gravity / GRAVITY))
    assert angle < 0.3  # the first force had 2 deg
    assert np.abs(estimate.bias - bias).max() < 0.05
    assert np.linalg.norm(estimate.gravity) == pytest.approx(GRAVITY, abs=0.02)


def test_the_length_of_gravity_stays_known_while_its_direction_is_found():
    """Its standard deviation on the earth is 0.02 m/s^2."""
    for seed in range(6):
        estimate, *_ = follow(np.random.default_rng(seed), count=20, first_sigma=1.0)
        up = estimate.up.vector
        assert np.linalg.norm(estimate.gravity) == pytest.approx(GRAVITY, abs=0.06)
        assert up @ estimate.covariance[6:9, 6:9] @ up <= 0.0205 ** 2


def test_a_position_that_noise_does_not_give_is_not_used():
    estimate, gravity, _, agreed = follow(np.random.default_rng(2), sudden=[60])
    assert not agreed[60]
    assert np.degrees(np.arccos(estimate.up.vector @ gravity / GRAVITY)) < 0.4


def test_a_frame_that_drifts_makes_the_direction_uncertain():
    estimate, *_ = follow(np.random.default_rng(3))
    before = estimate.up.covariance
    drift = np.diag(np.repeat([0.01, np.radians(1.0)], 3) ** 2)
    estimate.drift(drift)
    across = np.eye(3) - np.outer(estimate.up.vector, estimate.up.vector)
    assert np.allclose(estimate.up.covariance - before, np.radians(1.0) ** 2 * across, atol=1e-9)


def test_placed_it_forgets_the_velocity_but_not_gravity():
    estimate, gravity, *_ = follow(np.random.default_rng(4))
    before = estimate.up
    estimate.place(np.ones(3), 1e-6 * np.eye(3))
    assert np.array_equal(estimate.values[:6], [1, 1, 1, 0, 0, 0])
    assert np.allclose(np.diag(estimate.covariance)[:6], [*3 * [1e-6], *3 * [1.0]])
    expected = np.zeros((12, 12))
    expected[:6, :6] = np.diag([*3 * [1e-6], *3 * [1.0]])
    expected[6:, 6:] = estimate.covariance[6:, 6:]
    np.testing.assert_allclose(estimate.covariance, expected)  # nothing is correlated
    assert np.array_equal(estimate.up.covariance, before.covariance)
