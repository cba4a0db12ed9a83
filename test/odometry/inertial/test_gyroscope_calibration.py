# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors of a gyroscope, learned from rotations of a camera with known noise."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.gyroscope_calibration import GyroscopeCalibration
from aick_ros.odometry.inertial.rotation_integral import RotationIntegral
from aick_ros.settings import ImuSettings

SETTINGS = ImuSettings(gyroscope_bias_sigma=0.001, time_offset_sigma=0.002,
                       gyroscope_noise=1e-7, gyroscope_bias_walk=0.0,
                       gyroscope_scale_sigma=0.01, mounting_sigma=0.02)
EXACT_AXES = dataclasses.replace(SETTINGS, gyroscope_scale_sigma=0.0, mounting_sigma=0.0)
SIGMA = 1e-4  # rad, of the rotations of the camera
PERIOD = NANOSECONDS // 100


def rate(time):
    return np.array([1.2 * np.sin(2 * time), 0.8 * np.cos(3 * time), np.sin(1.4 * time + 1)])


STAMPS, RATES = PERIOD * np.arange(301), np.array([rate(0.01 * i) for i in range(301)])


@pytest.fixture(scope='module')
def integral():
    """Return the integral of samples of three seconds without bias."""
    result = RotationIntegral()
    result.add(STAMPS, RATES)
    return result


def learned(integral, bias, offset, rng, settings=EXACT_AXES, matrix=np.eye(3), count=12,
            sigma=SIGMA, frames=1):
    """
    Return the calibration by rotations of up to 0.2 s that a camera measures.

    Most of its error is the same in frames in a row, until the camera has turned by some degrees.

    :param matrix: by which the rates of the gyroscope are to be multiplied.
    :param count: number of keyframes; frames: number of frames registered to each one.
    """
    calibration, measured = GyroscopeCalibration(settings), RotationIntegral()
    measured.add(STAMPS, RATES @ np.linalg.inv(matrix).T + bias)

    def draw(share):
        return np.sqrt(share) * sigma * rng.standard_normal(3)

    for i in range(count):
        start = round((0.1 + 0.2 * (i % 12)) * NANOSECONDS)
        lasting, before = draw(0.7), np.eye(3)
        for k in range(frames):
            end = start + round(0.2 * (k + 1) / frames * NANOSECONDS)
            moved = [stamp + round(calibration.offset * NANOSECONDS) for stamp in (start, end)]
            turn = measured.between(*moved, calibration.bias, calibration.matrix)
            true = integral.between(*(stamp + round(offset * NANOSECONDS)
                                      for stamp in (start, end)), np.zeros(3))
            same = np.exp(-se3.angle(before.T @ true.rotation) / np.radians(6.0))
            lasting, before = same * lasting + draw(0.7 * (1.0 - same ** 2)), true.rotation
            seen = se3.exp_rotation(lasting + draw(0.3)) @ true.rotation
            calibration.learn(start, turn, se3.log_rotation(seen @ turn.rotation.T),
                              sigma ** 2 * np.eye(3))
    return calibration


def random_axes(rng):
    """Return a matrix as it is before anybody has calibrated."""
    return (np.eye(3) + SETTINGS.gyroscope_scale_sigma * rng.standard_normal((3, 3))
            + se3.skew(SETTINGS.mounting_sigma * rng.standard_normal(3)))


def test_errors_are_as_large_as_their_covariance(integral):
    rng = np.random.default_rng(1)
    squares, sigmas = [], []
    for _ in range(60):
        bias, offset = 0.001 * rng.standard_normal(3), 0.002 * rng.standard_normal()
        calibration = learned(integral, bias, offset, rng)
        error = calibration.values[:4] - [*bias, offset]
        covariance = calibration.covariance[:4, :4]
        squares.append(error @ np.linalg.solve(covariance, error))
        sigmas.append(np.sqrt(np.diag(covariance)))
        assert np.abs(calibration.covariance[4:13, 4:13]).max() < 1e-20
        np.testing.assert_allclose(calibration.matrix, np.eye(3), atol=1e-12)
    # chi-squared with 240 degrees of freedom, by 60: beyond these once in a thousand
    assert 3.0 < np.mean(squares) < 5.2
    assert (np.mean(sigmas, axis=0) < [3e-4, 3e-4, 3e-4, 1e-4]).all()


def test_axes_that_nobody_has_calibrated_are_learned(integral):
    rng = np.random.default_rng(2)
    squares, largest = [], []
    for _ in range(60):
        bias, offset = 0.001 * rng.standard_normal(3), 0.002 * rng.standard_normal()
        matrix = random_axes(rng)
        calibration = learned(integral, bias, offset, rng, SETTINGS, matrix, 60, 3e-4)
        error = calibration.values[:13] - [*bias, offset, *matrix.ravel()]
        squares.append(error @ np.linalg.solve(calibration.covariance[:13, :13], error))
        largest.append(np.abs(calibration.matrix - matrix).max())
    # chi-squared with 780 degrees of freedom, by 60: beyond these once in a thousand
    assert 11.0 < np.mean(squares) < 15.2
    assert np.mean(largest) < 0.006


def test_rotations_from_one_keyframe_have_most_of_their_errors_in_common(integral):
    rng, squares = np.random.default_rng(5), []
    for _ in range(60):
        bias, offset = 0.001 * rng.standard_normal(3), 0.002 * rng.standard_normal()
        calibration = learned(integral, bias, offset, rng, frames=6)
        error = calibration.values[:4] - [*bias, offset]
        squares.append(error @ np.linalg.solve(calibration.covariance[:4, :4], error))
    # chi-squared with 240 degrees of freedom, by 60: beyond these once in a thousand
    assert 3.0 < np.mean(squares) < 5.2


def test_the_noise_of_the_rates_adds_up_while_the_view_stays():
    """The last of many frames at rest knows the bias as well as all of them."""
    noise, rest = 1e-3, RotationIntegral()
    rest.add(PERIOD * np.arange(1000), np.zeros((1000, 3)))
    calibration = GyroscopeCalibration(dataclasses.replace(EXACT_AXES, gyroscope_noise=noise))
    for k in range(1, 200):
        turn = rest.between(0, 4 * k * PERIOD, calibration.bias)
        calibration.learn(0, turn, np.zeros(3), 1e-12 * np.eye(3))
    before = EXACT_AXES.gyroscope_bias_sigma
    by_last = 1.0 / np.sqrt(turn.duration / noise ** 2 + 1.0 / before ** 2)
    assert np.sqrt(np.diag(calibration.covariance))[:3] == pytest.approx(3 * [by_last], rel=1e-3)


def test_a_keyframe_that_is_off_while_the_camera_rests_is_no_other_gyroscope(integral):
    rng, rest = np.random.default_rng(6), RotationIntegral()
    rest.add(PERIOD * np.arange(1000), np.zeros((1000, 3)))
    for _ in range(10):
        calibration = learned(
            integral, np.zeros(3), 0.0, rng, SETTINGS, random_axes(rng), 60, 3e-4)
        before = calibration.values.copy()
        sigma = np.sqrt(np.diag(calibration.covariance))
        error = np.radians(0.3) * se3.exp_rotation(rng.standard_normal(3))[0]
        for k in range(8):
            turn = rest.between(NANOSECONDS, NANOSECONDS + round(0.3 * 1.5 ** k * NANOSECONDS),
                                calibration.bias, calibration.matrix)
            seen = se3.exp_rotation(error) @ turn.rotation
            calibration.learn(NANOSECONDS, turn, se3.log_rotation(seen @ turn.rotation.T),
                              3e-4 ** 2 * np.eye(3))
        # by four and three standard deviations where it counts as eight independent rotations
        assert (np.abs(calibration.values - before) < 3.0 * sigma)[:4].all()
        assert (np.abs(calibration.values - before) < 2.0 * sigma)[4:13].all()


def test_exact_axes_are_soon_known_to_be_exact(integral):
    rng = np.random.default_rng(3)
    for _ in range(10):
        calibration = learned(integral, np.zeros(3), 0.0, rng, SETTINGS)
        assert np.sqrt(np.diag(calibration.covariance)[4:13].max()) < 0.001
        assert np.abs(calibration.matrix - np.eye(3)).max() < 0.001


def test_small_errors_of_axes_are_learned_too(integral):
    rng, matrix = np.random.default_rng(4), np.eye(3) + se3.skew([0.003, 0.0, 0.0])
    calibration = learned(integral, np.zeros(3), 0.0, rng, SETTINGS, matrix, 120)
    assert np.abs(calibration.matrix - matrix).max() < 0.001


@pytest.mark.parametrize('change', [
    {'gyroscope_bias_sigma': 0.05}, {'gyroscope_scale_sigma': 0.02}, {'mounting_sigma': 0.05},
    {'time_offset': 0.02}, {'time_offset_sigma': 0.01}])
def test_with_other_first_values_it_begins_anew(integral, change):
    settings = dataclasses.replace(ImuSettings(), **change)
    calibration, new = GyroscopeCalibration(ImuSettings()), GyroscopeCalibration(settings)
    turn = integral.between(0, NANOSECONDS, np.zeros(3))
    calibration.learn(0, turn, np.full(3, 0.01), 1e-6 * np.eye(3))
    learned = calibration.values
    calibration.configure(dataclasses.replace(
        ImuSettings(), gyroscope_noise=0.001, gyroscope_bias_walk=0.01))
    np.testing.assert_array_equal(calibration.values, learned)
    calibration.configure(settings)
    np.testing.assert_array_equal(calibration.values, new.values)
    np.testing.assert_array_equal(calibration.covariance, new.covariance)


def test_the_bias_drifts_and_nothing_else(integral):
    calibration = GyroscopeCalibration(ImuSettings(gyroscope_bias_walk=0.01))
    before = np.diag(calibration.covariance)[:13].copy()
    calibration.elapse(4.0)
    assert np.diag(calibration.covariance)[:13] - before == pytest.approx(
        [*3 * [4e-4], *10 * [0.0]])
    turn = integral.between(0, NANOSECONDS, np.zeros(3))
    calibration.learn(0, turn, np.zeros(3), 1e12 * np.eye(3))  # which says nothing
    assert np.diag(calibration.covariance)[:13] - before == pytest.approx(
        [*3 * [4e-4], *10 * [0.0]])
