# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Uncertain positions are held by the velocity before them, certain ones are not."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import Odometry
from aick_ros.odometry.position_filter import PositionFilter
from aick_ros.settings import OdometrySettings, Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

INTERVAL = 0.05
STEP = 50_000_000  # ns, the same
ACCELERATION = OdometrySettings().acceleration_sigma


def with_position_covariance(matrix, variances):
    """Return a pose with uncorrelated errors of its position."""
    return PoseWithCovariance(matrix.copy(), np.diag([*variances, 0.0, 0.0, 0.0]))


def filtered(positions, sigmas, rotation=np.eye(3)):
    """Return the filtered positions, Nx3, of cameras with standard deviations along the axes."""
    position_filter = PositionFilter(OdometrySettings())
    published = []
    for i, position in enumerate(positions):
        measured = np.eye(4)
        measured[:3, :3], measured[:3, 3] = rotation, position
        position_filter.update(i * STEP, with_position_covariance(measured, np.square(sigmas)))
        published.append((measured @ position_filter.T_measured_filtered)[:3, 3])
    return np.array(published)


def test_the_noise_left_is_that_of_the_steady_state():
    # the alpha-beta filter in closed form (Kalata 1984) for accelerations constant over a frame
    sigma = 0.01
    index = ACCELERATION * INTERVAL ** 2 / sigma
    r = (4.0 + index - np.sqrt(8.0 * index + index ** 2)) / 4.0
    alpha = 1.0 - r ** 2
    rng = np.random.default_rng(3)
    velocity, positions = np.zeros(3), [np.zeros(3)]
    for acceleration in rng.normal(0.0, ACCELERATION, (4000, 3)):
        positions.append(positions[-1] + velocity * INTERVAL + 0.5 * acceleration * INTERVAL ** 2)
        velocity = velocity + acceleration * INTERVAL
    noisy = np.array(positions) + rng.normal(0.0, sigma, (4001, 3))
    errors = filtered(noisy, [sigma] * 3) - positions
    assert np.mean(errors[100:] ** 2) == pytest.approx(alpha * sigma ** 2, rel=0.06)


def test_position_and_velocity_are_those_of_least_squares_over_all_frames():
    """One acceleration in each interval, of frames at uneven ones: all unknowns at once."""
    rng, count = np.random.default_rng(6), 9
    intervals = rng.uniform(0.05, 0.3, count - 1)
    positions, sigmas = rng.normal(0.0, 0.02, (count, 3)), rng.uniform(0.005, 0.02, (count, 3))
    position_filter = PositionFilter(OdometrySettings())
    for stamp, position, sigma in zip(np.r_[0.0, np.cumsum(intervals)], positions, sigmas):
        measured = np.eye(4)
        measured[:3, 3] = position
        position_filter.update(round(1e9 * stamp), with_position_covariance(measured, sigma ** 2))
    # rows by the first position, the first velocity (0 within 1 m/s) and the accelerations
    rows, speeds = [np.eye(count + 1)[0]], [np.eye(count + 1)[1]]
    for i, interval in enumerate(intervals):
        by_acceleration = np.eye(count + 1)[2 + i]
        rows.append(rows[-1] + interval * speeds[-1] + 0.5 * interval ** 2 * by_acceleration)
        speeds.append(speeds[-1] + interval * by_acceleration)
    priors = np.diag(1.0 / np.r_[1.0, np.full(count - 1, ACCELERATION)]) @ np.eye(count + 1)[1:]
    expected = [np.linalg.lstsq(np.vstack([np.array(rows) / sigma[:, None], priors]),
                                np.r_[position / sigma, np.zeros(count)], rcond=None)[0]
                for position, sigma in zip(positions.T, sigmas.T)]
    filtered_position = measured[:3, 3] + position_filter.T_measured_filtered[:3, 3]
    np.testing.assert_allclose(filtered_position, np.array(expected) @ rows[-1], atol=1e-8)
    np.testing.assert_allclose(position_filter.velocity, np.array(expected) @ speeds[-1],
                               atol=1e-7)


def test_a_constant_velocity_is_not_held_back():
    path = np.arange(80)[:, None] * INTERVAL * np.array([0.5, -0.2, 1.0])
    np.testing.assert_allclose(filtered(path, [0.05] * 3)[-1], path[-1], atol=1e-3)


def test_only_what_is_uncertain_is_held():
    path = np.zeros((30, 3))
    path[20] = 0.004, 0.02, 0.004  # less than accelerations explain
    published = filtered(path, [1e-5, 0.1, 1e-5], se3.exp([0, 0, 0, 0.4, -1.0, 2.0])[:3, :3])
    np.testing.assert_allclose(published[20, [0, 2]], 0.004, atol=1e-5)
    assert abs(published[20, 1]) < 0.01


def test_a_knock_is_followed_at_once():
    path = np.zeros((12, 3))
    path[10:, 0] = 0.1
    np.testing.assert_array_equal(filtered(path, [0.005] * 3)[10], path[10])


def test_the_velocity_has_less_noise_than_the_last_step():
    """Along the axes of the camera, against the truth."""
    rng, position_filter, errors = np.random.default_rng(5), PositionFilter(OdometrySettings()), []
    velocity, sigma, turn = np.array([0.3, -0.1, 0.2]), 0.01, se3.exp([0, 0, 0, 0.4, -1.0, 2.0])
    for i in range(400):
        measured = turn.copy()
        measured[:3, 3] = i * INTERVAL * velocity + rng.normal(0.0, sigma, 3)
        position_filter.update(i * STEP, with_position_covariance(measured, [sigma ** 2] * 3))
        if i > 20:
            errors.append(position_filter.velocity - turn[:3, :3].T @ velocity)
    of_a_step = np.sqrt(2) * sigma / INTERVAL
    assert np.sqrt(np.mean(np.square(errors))) < 0.6 * of_a_step
    assert np.abs(np.mean(errors, axis=0)).max() < 0.1 * of_a_step


def test_no_velocity_is_known_of_one_frame_nor_after_a_knock_nor_without_the_prior():
    position_filter, measured = PositionFilter(OdometrySettings()), np.eye(4)

    def updated(i, x):
        measured[0, 3] = x
        position_filter.update(i * STEP, with_position_covariance(measured, [1e-6] * 3))
        return position_filter.velocity

    assert updated(0, 0.0) is None
    assert updated(1, 0.01)[0] == pytest.approx(0.01 / INTERVAL, rel=0.01)
    assert updated(2, 5.0) is None  # knocked
    assert updated(3, 5.0) is not None
    position_filter.configure(OdometrySettings(motion_prior=False))
    assert updated(4, 5.0) is None


def test_after_a_reset_it_begins_with_the_next_pose():
    position_filter, measured = PositionFilter(OdometrySettings()), np.eye(4)
    begun = position_filter.T_measured_filtered, position_filter.velocity
    for i in range(9):
        measured[0, 3] = 0.01 * i ** 2
        position_filter.update(i * STEP, with_position_covariance(measured, [1e-4] * 3))
    assert position_filter.velocity is not None
    position_filter.reset()
    for found, velocity in (begun, (position_filter.T_measured_filtered,
                                    position_filter.velocity)):
        np.testing.assert_array_equal(found, np.eye(4))
        assert velocity is None
    position_filter.update(9 * STEP, with_position_covariance(measured, [1e-4] * 3))
    np.testing.assert_array_equal(position_filter.T_measured_filtered, np.eye(4))
    assert position_filter.velocity is None


def test_a_knock_is_farther_than_its_limit(monkeypatch):
    """The squared distance of the second of two positions, by the variance of their difference."""
    variance, error = 1e-4, 0.25
    expected = 2 * variance + INTERVAL ** 2 + (0.5 * ACCELERATION * INTERVAL ** 2) ** 2
    for factor, is_knocked in ((0.999, True), (1.001, False)):
        monkeypatch.setattr('aick_ros.odometry.position_filter.LARGEST_SQUARED_DISTANCES',
                            {3: factor * error ** 2 / expected})
        position_filter, measured = PositionFilter(OdometrySettings()), np.eye(4)
        for i in range(2):
            measured[1, 3] = i * error
            position_filter.update(i * STEP, with_position_covariance(measured, [variance] * 3))
        assert (position_filter.velocity is None) == is_knocked


def test_without_the_prior_positions_are_as_measured_from_the_next_frame_on():
    position_filter = PositionFilter(OdometrySettings())
    rng, measured = np.random.default_rng(4), np.eye(4)
    for i in range(20):
        measured[:3, 3] = rng.normal(0.0, 0.01, 3)
        position_filter.update(i * STEP, with_position_covariance(measured, [1e-4] * 3))
    assert not np.array_equal(position_filter.T_measured_filtered, np.eye(4))
    position_filter.configure(OdometrySettings(motion_prior=False))
    position_filter.update(20 * STEP, with_position_covariance(measured, [1e-4] * 3))
    np.testing.assert_array_equal(position_filter.T_measured_filtered, np.eye(4))


def test_after_an_interruption_the_velocity_before_counts_for_nothing():
    position_filter, measured = PositionFilter(OdometrySettings()), np.eye(4)
    for i in range(20):
        measured[0, 3] = i * INTERVAL
        position_filter.update(i * STEP, with_position_covariance(measured, [1e-6] * 3))
    position_filter.update(20 * STEP + 5_000_000_000,
                           with_position_covariance(measured, [1e-6] * 3))
    np.testing.assert_allclose(position_filter.T_measured_filtered, np.eye(4), atol=1e-6)


def test_what_is_held_back_does_not_add_up():
    """The path published differs from the one measured by noise, at its end as at its start."""
    source = SyntheticSource(SyntheticOptions(frames=40, seed=5))
    frames = list(source.frames())
    paths, twists = [], []
    for motion_prior in (False, True):
        settings = Settings(odometry=dataclasses.replace(
            OdometrySettings(), motion_prior=motion_prior, max_keyframes=0))
        odometry = Odometry(settings)
        updates = [odometry.register_frame(frame) for frame in frames]
        paths.append(np.array([update.T_odom_camera for update in updates]))
        twists.append(np.array([update.prepared.twist for update in updates[1:]]))
    measured, published = paths
    np.testing.assert_array_equal(published[:, :3, :3], measured[:, :3, :3])
    distances = np.linalg.norm(published[:, :3, 3] - measured[:, :3, 3], axis=1)
    assert 0.0 < distances[-20:].max() < 0.004
    # frames have the velocity of the filter, and the turn rate as it was measured
    np.testing.assert_array_equal(twists[0][:, 3:], twists[1][:, 3:])
    assert 0.0 < np.abs(twists[0] - twists[1])[:, :3].max() < 0.05
