# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Gravity, bias and place of an IMU on a camera whose motion, noise and truth are known."""

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.inertial import gravity_filter
from aick_ros.odometry.inertial.force_integral import Impulse
from aick_ros.odometry.inertial.gravity_filter import GRAVITY, GravityFilter
from aick_ros.settings import ImuSettings

STEP = 1 / 15  # s
SETTINGS = ImuSettings(accelerometer_bias_walk=0.0)
POSITION_SIGMA, ORIENTATION_SIGMA = 0.002, 1e-4
FIRST_SIGMA = 0.5  # m/s^2


@pytest.fixture(autouse=True)
def white_noise(monkeypatch):
    """Let the forces have no errors but those that the settings say."""
    monkeypatch.setattr(gravity_filter, '_UNMODELLED', 0.0)


def orientation(time):
    return se3.exp_rotation([0.5 * np.sin(1.3 * time), 0.4 * np.sin(0.9 * time), 0.6 * time + 1.0])


def placed(position, covariance, rotation=np.eye(3)):
    """Return the pose of a camera with the covariance of its position."""
    pose, joint = np.eye(4), np.zeros((6, 6))
    pose[:3, :3], pose[:3, 3], joint[:3, :3] = rotation, position, covariance
    return PoseWithCovariance(pose, joint)


def impulse(time, velocity, position, once, twice, by_offset=np.zeros((2, 3))):
    """Return an impulse; by_offset: derivatives of velocity and position."""
    return Impulse(time, velocity, position, once, twice, *by_offset)


def follow(rng, count=75, sudden=(), first_sigma=FIRST_SIGMA, lever_arm=np.zeros(3),
           mounting=np.eye(3)):
    """Return a filter after some frames, and the true gravity and bias."""
    gravity = GRAVITY * se3.exp_rotation([0.3, -0.2, 0]) @ [0, 0, 1]
    bias = SETTINGS.accelerometer_bias_sigma * rng.standard_normal(3)
    position, velocity = np.zeros(3), rng.uniform(-0.5, 0.5, 3)  # of the IMU
    covariance = POSITION_SIGMA ** 2 * np.eye(3)

    def measured(time):
        turn = orientation(time)
        return placed(position - turn @ lever_arm + POSITION_SIGMA * rng.standard_normal(3),
                      covariance, turn)

    first = gravity + first_sigma * rng.standard_normal(3)
    estimate = GravityFilter(
        SETTINGS, mounting @ (orientation(0.0).T @ first + bias), first_sigma ** 2 * np.eye(3),
        measured(0.0), SETTINGS.position_sigma)
    agreed = []
    for index in range(count):
        turn = orientation(STEP * (index + 0.5))
        acceleration = np.array([np.sin(2.0 * STEP * index), np.cos(3.0 * STEP * index), 0.3])
        noise = SETTINGS.accelerometer_noise / np.sqrt(STEP) * rng.standard_normal(3)
        force = turn @ mounting @ turn.T @ (acceleration + gravity + turn @ bias + noise)
        position = position + STEP * velocity + 0.5 * STEP ** 2 * acceleration
        velocity = velocity + STEP * acceleration
        estimate.predict(impulse(STEP, STEP * force, 0.5 * STEP ** 2 * force, STEP * turn,
                                 0.5 * STEP ** 2 * turn), ORIENTATION_SIGMA ** 2 * np.eye(3))
        seen = measured(STEP * (index + 1))
        seen.matrix[:3, 3] += 0.3 if index in sudden else 0.0
        agreed.append(estimate.measure(seen))
        if not agreed[-1] and index not in sudden:
            estimate.place(seen)
    return estimate, gravity, bias, agreed


@pytest.mark.parametrize('first_sigma', [0.2, FIRST_SIGMA])
def test_errors_are_as_large_as_their_covariance(first_sigma):
    """In the median: about a start that is tilted by far the length of gravity is not linear."""
    squared, shares, arms = [], [], []
    for seed in range(40):
        lever_arm = SETTINGS.position_sigma * np.random.default_rng([seed, 1]).standard_normal(3)
        estimate, gravity, bias, agreed = follow(
            np.random.default_rng(seed), first_sigma=first_sigma, lever_arm=lever_arm)
        error = np.concatenate([estimate.gravity - gravity, estimate.bias - bias,
                                estimate.lever_arm - lever_arm])
        squared.append(error @ np.linalg.solve(estimate.covariance[6:15, 6:15], error))
        shares.append(np.mean(agreed))
        arms.append(error[6:] / estimate.lever_arm_sigma)
    assert np.median(shares) > 0.99
    assert 5.8 < np.median(squared) < 11.4  # of nine; 0.1 % to 99.9 % of the median of 40
    assert 0.4 < np.sqrt(np.mean(np.square(arms))) < 1.2  # their sigma is the largest one


def test_the_noise_of_a_force_moves_the_camera_as_long_as_it_lasts():
    """White noise n over t: a force of variance n^2 / t, constant over it, as in the impulse."""
    time, noise, covariances = 0.1, 0.3, []
    for density in (1e-6, noise):
        settings = ImuSettings(accelerometer_noise=density)
        estimate = GravityFilter(settings, np.array([0, 0, GRAVITY]), 1e-4 * np.eye(3),
                                 placed(np.zeros(3), 1e-6 * np.eye(3)))
        estimate.predict(impulse(time, np.zeros(3), np.zeros(3), time * np.eye(3),
                                 0.5 * time ** 2 * np.eye(3)), np.zeros((3, 3)))
        covariances.append(estimate.covariance)
    by_force = np.zeros((16, 3))
    by_force[:6] = np.kron([[0.5 * time ** 2], [time]], np.eye(3))
    np.testing.assert_allclose(covariances[1] - covariances[0],
                               noise ** 2 / time * by_force @ by_force.T, atol=1e-12)


def test_what_is_no_white_noise_is_added_to_it(monkeypatch):
    """So that an accelerometer whose noise at rest was measured is not taken for exact."""
    covariances = []
    for settings, more in ((ImuSettings(accelerometer_noise=0.05), 0.0),
                           (ImuSettings(accelerometer_noise=0.03), 0.04)):
        monkeypatch.setattr(gravity_filter, '_UNMODELLED', more)
        estimate = any_filter(settings)
        estimate.predict(impulse(0.1, np.zeros(3), np.zeros(3), 0.1 * np.eye(3),
                                 0.005 * np.eye(3)), np.zeros((3, 3)))
        covariances.append(estimate.covariance)
    np.testing.assert_allclose(*covariances, atol=1e-15)


def test_five_seconds_tell_gravity_from_motion_and_bias():
    estimate, gravity, bias, _ = follow(np.random.default_rng(1))
    angle = np.degrees(np.arccos(estimate.up.vector @ gravity / GRAVITY))
    assert angle < 0.3  # the first force had 2 deg
    assert np.abs(estimate.bias - bias).max() < 0.05
    assert np.linalg.norm(estimate.gravity) == pytest.approx(GRAVITY, abs=0.02)


def test_five_seconds_show_where_it_is():
    """A camera that turns by half a radian accelerates an IMU beside it."""
    lever_arm = np.array([-0.11, 0.04, 0.02])
    estimate, *_ = follow(np.random.default_rng(6), lever_arm=lever_arm)
    assert np.abs(estimate.lever_arm - lever_arm).max() < 0.05
    assert estimate.lever_arm_sigma < 0.05
    exact = GravityFilter(SETTINGS, np.array([0, 0, GRAVITY]), np.eye(3),
                          placed(np.zeros(3), np.eye(3)))
    assert exact.lever_arm_sigma == exact.time_offset_sigma == 0.0


def test_a_late_clock_is_found_by_forces_that_change():
    """The derivative of their integral by the stamps is their change from start to end."""
    late, estimate = 0.02, any_filter(ImuSettings(accelerometer_noise=1e-6))
    estimate.covariance = np.zeros((16, 16))
    estimate.covariance[15, 15], estimate.values[12:] = 0.03 ** 2, 0.0
    slope = np.array([4.0, -2.0, 1.0])  # m/s^3
    by_offset = np.array([0.1 * slope, 0.005 * slope])
    once, twice = 0.1 * np.eye(3), 0.005 * np.eye(3)
    estimate.predict(impulse(0.1, np.zeros(3), np.zeros(3), once, twice, by_offset),
                     np.zeros((3, 3)))
    truth = estimate.values[:3] + late * by_offset[1]
    assert estimate.measure(placed(truth, 1e-12 * np.eye(3)))
    assert estimate.time_offset == pytest.approx(late, rel=0.02)
    assert estimate.time_offset_sigma < 0.1 * 0.03  # as it was before
    before = estimate.values[3:6].copy()
    none = np.zeros((3, 3))
    estimate.predict(impulse(1e-9, np.zeros(3), np.zeros(3), none, none, by_offset), none)
    np.testing.assert_allclose(estimate.values[3:6], before, atol=1e-6)  # the impulse has it


def test_the_length_of_gravity_stays_known_while_its_direction_is_found():
    """Its standard deviation on the earth is 0.02 m/s^2."""
    for seed in range(6):
        estimate, *_ = follow(np.random.default_rng(seed), count=20, first_sigma=1.0)
        up = estimate.up.vector
        assert np.linalg.norm(estimate.gravity) == pytest.approx(GRAVITY, abs=0.06)
        assert up @ estimate.covariance[6:9, 6:9] @ up <= 0.0205 ** 2


def test_the_length_of_gravity_is_no_new_measurement_in_each_frame():
    """Against a start that is tilted by far, where it is not linear in the error."""
    angles = []
    for seed in range(20):
        estimate, gravity, *_ = follow(np.random.default_rng(seed), first_sigma=1.0)
        up = estimate.up.vector
        assert up @ estimate.covariance[6:9, 6:9] @ up > 0.01 ** 2
        angles.append(np.degrees(np.arccos(up @ gravity / GRAVITY)))
    assert np.sqrt(np.mean(np.square(angles))) < 0.25


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


@pytest.mark.parametrize('is_held, share', [(False, 0.02), (True, 0.3)])
@pytest.mark.parametrize('count, sudden', [(1, ()), (20, ()), (75, (30,))])
def test_turned_it_is_as_if_all_forces_had_been_turned_from_the_start(
        monkeypatch, count, sudden, is_held, share):
    """To first order, but for the direction in which the length of gravity is held."""
    if not is_held:
        monkeypatch.setattr(GravityFilter, '_hold_length', lambda self: None)
    turn, arm = se3.exp_rotation([2e-3, -1e-3, 1.5e-3]), np.array([0.1, -0.05, 0.02])
    right, wrong = (follow(np.random.default_rng(3), count, sudden, lever_arm=arm,
                           mounting=mounting)[0] for mounting in (np.eye(3), turn.T))
    off = np.abs(wrong.gravity - right.gravity).max()
    covariance = wrong.covariance.copy()
    wrong.turn(turn)
    assert off > 2e-3
    np.testing.assert_allclose(wrong.values, right.values, atol=share * off)
    np.testing.assert_array_equal(wrong.covariance, covariance)


def test_a_copy_and_one_from_the_origin_are_turned_by_themselves():
    turn = se3.exp_rotation([0.02, -0.01, 0.015])
    estimate = follow(np.random.default_rng(3), 40)[0]
    before, others = estimate.values.copy(), (estimate.copy(), estimate.from_origin())
    for other in others:
        other.turn(turn)
    np.testing.assert_array_equal(estimate.values, before)
    np.testing.assert_array_equal(others[0].values[3:], others[1].values[3:])
    np.testing.assert_array_equal(others[1].values[:3], np.zeros(3))
    estimate.turn(turn)
    np.testing.assert_array_equal(estimate.values, others[0].values)


def test_placed_it_forgets_the_velocity_but_not_gravity():
    estimate, gravity, *_ = follow(np.random.default_rng(4))
    before = estimate.up
    kept, turn = estimate.covariance.copy(), orientation(1.0)
    estimate.place(placed(np.ones(3), 1e-6 * np.eye(3), turn))
    np.testing.assert_allclose(estimate.values[:3], 1 + turn @ estimate.lever_arm)
    assert not estimate.values[3:6].any()
    expected = np.zeros((16, 16))
    expected[3:6, 3:6], expected[6:, 6:] = np.eye(3), kept[6:, 6:]
    expected[:3] = turn @ expected[12:15]
    expected[:, :3] = expected[:3].T
    expected[:3, :3] = turn @ kept[12:15, 12:15] @ turn.T + 1e-6 * np.eye(3)
    np.testing.assert_allclose(estimate.covariance, expected, atol=1e-15)
    assert np.array_equal(estimate.up.covariance, before.covariance)


def covariance_of(rng, size=16):
    root = rng.normal(0.0, 0.1, (size, size))
    return root @ root.T


def any_filter(settings=SETTINGS, seed=0):
    """Return a filter in a state in which all is correlated."""
    rng = np.random.default_rng(seed)
    estimate = GravityFilter(settings, np.array([1.0, -2.0, 9.5]), np.eye(3),
                             placed(np.zeros(3), np.eye(3)))
    estimate.values = rng.normal(size=16) + np.append(np.repeat([0, 0, 3, 0, 0], 3), 0)
    estimate.covariance = covariance_of(rng)
    return estimate


def test_a_prediction_is_the_motion_of_each_possible_state():
    """Of states drawn from the estimate, each moved by the equations of motion."""
    rng, time = np.random.default_rng(7), 0.2
    settings = ImuSettings(accelerometer_noise=0.5, accelerometer_bias_walk=0.3)
    estimate, (once, twice) = any_filter(settings), rng.normal(size=(2, 3, 3))
    by_offset = rng.normal(size=(2, 3))
    given = impulse(time, rng.normal(size=3), rng.normal(size=3), once, twice, by_offset)
    turned = 1e-3 * covariance_of(rng, 3)
    errors = np.linalg.cholesky(estimate.covariance) @ rng.normal(size=(16, 200_000))
    p, v, g, b, arm = (estimate.values[:15, None] + errors[:15]).reshape(5, 3, -1)
    gravity, late = estimate.gravity[:, None], errors[15]  # beside the offset known
    force = settings.accelerometer_noise / np.sqrt(time) * rng.normal(size=p.shape)
    force += np.cross(np.linalg.cholesky(turned) @ rng.normal(size=p.shape), gravity, axis=0)
    moved = np.concatenate([
        p + time * v + given.position[:, None] - twice @ b - 0.5 * time ** 2 * g
        + 0.5 * time ** 2 * force + np.outer(by_offset[1], late),
        v + given.velocity[:, None] - once @ b - time * g + time * force
        + np.outer(by_offset[0], late), g,
        b + settings.accelerometer_bias_walk * np.sqrt(time) * rng.normal(size=p.shape), arm,
        estimate.values[15] + late[None]])
    estimate.predict(given, turned)
    np.testing.assert_allclose(estimate.values, moved.mean(axis=1), atol=0.01)
    np.testing.assert_allclose(estimate.covariance, np.cov(moved), atol=0.012)


def test_a_prediction_is_that_of_its_linear_equations():
    rng, time, settings = np.random.default_rng(8), 0.1, ImuSettings()
    estimate, (once, twice) = any_filter(settings), rng.normal(size=(2, 3, 3))
    by_offset = rng.normal(size=(2, 3))
    given = impulse(time, rng.normal(size=3), rng.normal(size=3), once, twice, by_offset)
    turned, none, one = covariance_of(rng, 3), np.zeros((10, 3)), np.eye(3)
    transition = np.eye(16)
    transition[:3, 3:12] = np.hstack([time * one, -0.5 * time ** 2 * one, -twice])
    transition[3:6, 6:12] = np.hstack([-time * one, -once])
    values = transition @ estimate.values + np.r_[given.position, given.velocity, np.zeros(10)]
    transition[:6, 15] = by_offset[::-1].ravel()  # the impulse is that at the offset known
    arm = np.cross(np.eye(3), estimate.gravity)
    force = settings.accelerometer_noise ** 2 * time * one + time ** 2 * arm @ turned @ arm.T
    by_force = np.concatenate([0.5 * time * one, one, none])
    covariance = transition @ estimate.covariance @ transition.T + by_force @ force @ by_force.T
    covariance[9:12, 9:12] += settings.accelerometer_bias_walk ** 2 * time * one
    estimate.predict(given, turned)
    np.testing.assert_allclose(estimate.values, values, rtol=1e-12)
    np.testing.assert_allclose(estimate.covariance, covariance, rtol=1e-9, atol=1e-14)
    np.testing.assert_array_equal(estimate.covariance, estimate.covariance.T)


def test_a_prediction_with_what_does_not_fit_is_refused_and_changes_nothing():
    estimate, two = any_filter(), np.eye(2)
    before, covariance = estimate.values.copy(), estimate.covariance.copy()
    three = np.eye(3)
    for given, turned in (
            (impulse(0.1, np.ones(3), np.ones(3), three, two), three),
            (impulse(0.1, np.ones(2), np.ones(3), three, three), three),
            (impulse(0.1, np.ones(3), np.ones(3), three, three, np.ones((2, 2))), three),
            (impulse(0.1, np.ones(3), np.ones(3), three, three), two)):
        with pytest.raises(ValueError, match='are required'):
            estimate.predict(given, turned)
    np.testing.assert_array_equal(estimate.values, before)
    np.testing.assert_array_equal(estimate.covariance, covariance)


def test_a_drift_is_that_of_each_axis():
    """About x it moves what is up along y."""
    estimate, drift = any_filter(), np.diag([1.0, 2, 3, 4, 5, 6]) * 0.01 ** 2
    estimate.values[6:9] = 0, 0, 9.8
    before = estimate.covariance.copy()
    estimate.drift(drift)
    added = np.diag(estimate.covariance - before)
    np.testing.assert_allclose(added[:3], [1e-4, 2e-4, 3e-4])
    np.testing.assert_allclose(added[6:9], 9.8 ** 2 * np.array([5e-4, 4e-4, 0]), atol=1e-12)
    assert not added[3:6].any() and not added[9:].any()


@pytest.mark.parametrize('factor, agrees', [(0.99, True), (1.01, False)])
def test_one_position_in_a_thousand_of_noise_disagrees(factor, agrees):
    estimate, noise = any_filter(), 0.03 ** 2 * np.diag([1.0, 2.0, 3.0])
    values, covariance = estimate.values.copy(), estimate.covariance.copy()
    turn = orientation(1.0)
    rows = np.hstack([np.eye(3), np.zeros((3, 9)), -turn, np.zeros((3, 1))])
    spread = np.linalg.cholesky(rows @ covariance @ rows.T + noise)
    error = factor * np.sqrt(chi2.ppf(0.999, 3)) * spread @ [0.6, 0.0, 0.8]
    assert estimate.measure(placed(rows @ values + error, noise, turn)) is agrees
    if not agrees:
        np.testing.assert_array_equal(estimate.values, values)
        np.testing.assert_array_equal(estimate.covariance, covariance)
    else:
        assert np.trace(estimate.covariance) < np.trace(covariance)


@pytest.mark.parametrize('sigma', [0.3, 1.0])
def test_gravity_of_an_uncertain_direction_is_shorter_along_the_expected_one(sigma):
    """Against vectors of its length whose directions are drawn: mean and scatter along z."""
    across = sigma * np.random.default_rng(3).standard_normal((100_000, 2))
    along = np.sqrt(GRAVITY ** 2 - (across ** 2).sum(1))
    estimate = GravityFilter(ImuSettings(accelerometer_bias_sigma=0.0), np.array([0, 0, 9.9]),
                             np.diag([sigma ** 2, sigma ** 2, 1e6]),
                             placed(np.zeros(3), np.eye(3)))
    assert estimate.gravity[2] == pytest.approx(along.mean(), abs=0.003)
    assert estimate.covariance[8, 8] == pytest.approx(0.02 ** 2 + along.var(), rel=0.1)


def test_the_first_force_has_the_bias_too():
    """Against draws of bias and acceleration: what of a force across gravity is which."""
    rng, turn, sigmas = np.random.default_rng(9), orientation(2.0), (0.7, 0.5)
    bias, acceleration = (sigma * rng.standard_normal((100_000, 3)) for sigma in sigmas)
    errors = np.column_stack([(acceleration + bias @ turn.T)[:, :2], -(bias @ turn.T)[:, :2]])
    estimate = GravityFilter(
        ImuSettings(accelerometer_bias_sigma=sigmas[0]), turn.T @ [0.0, 0.0, GRAVITY],
        sigmas[1] ** 2 * np.eye(3), placed(np.zeros(3), np.eye(3), turn))
    axes = np.zeros((4, 6))
    axes[:2, :2], axes[2:, 3:] = np.eye(2), turn[:2]
    np.testing.assert_allclose(axes @ estimate.covariance[6:12, 6:12] @ axes.T, np.cov(errors.T),
                               atol=0.01)


def test_a_bias_is_as_uncertain_at_first_as_the_settings_say():
    estimate = GravityFilter(
        ImuSettings(accelerometer_bias_sigma=0.03), np.array([0, 0, 9.9]),
        np.diag([1e-3, 1e-3, 1.0]), placed([1.0, 2.0, 3.0], 4e-4 * np.eye(3)))
    np.testing.assert_allclose(np.diag(estimate.covariance)[[0, 3, 9, 10, 11]],
                               [4e-4, 1.0, 9e-4, 9e-4, 9e-4], rtol=2e-3)
    np.testing.assert_allclose(estimate.values[:6], [1, 2, 3, 0, 0, 0])
    assert estimate.gravity == pytest.approx([0, 0, GRAVITY], abs=1e-3)
    # its length is known at once
    assert np.sqrt(estimate.covariance[8, 8]) == pytest.approx(0.02, rel=1e-3)
