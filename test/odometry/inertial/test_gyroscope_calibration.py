# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Bias and time offset, learned from rotations of a camera with known noise."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.gyroscope_calibration import GyroscopeCalibration
from aick_ros.odometry.inertial.rotation_integral import RotationIntegral
from aick_ros.settings import ImuSettings

SETTINGS = ImuSettings(gyroscope_bias_sigma=0.001, time_offset_sigma=0.002,
                       gyroscope_bias_walk=0.0)
SIGMA = 1e-4  # rad, of the rotations of the camera
PERIOD = NANOSECONDS // 100


def rate(time):
    return np.array([1.2 * np.sin(2 * time), 0.8 * np.cos(3 * time), np.sin(1.4 * time + 1)])


@pytest.fixture(scope='module')
def integral():
    """Return the integral of samples of three seconds without bias."""
    result = RotationIntegral()
    result.add(PERIOD * np.arange(301), np.array([rate(0.01 * i) for i in range(301)]))
    return result


def learned(integral, bias, offset, rng):
    """Return the calibration by twelve rotations that a camera measures."""
    calibration = GyroscopeCalibration(SETTINGS)
    for i in range(12):
        start, end = (round((0.1 + 0.2 * k) * NANOSECONDS) for k in (i, i + 1))
        moved = [stamp + round(calibration.offset * NANOSECONDS) for stamp in (start, end)]
        turn = integral.between(*moved, calibration.bias - bias)  # its samples have the bias
        true = integral.between(*(stamp + round(offset * NANOSECONDS)
                                  for stamp in (start, end)), np.zeros(3))
        seen = se3.exp_rotation(SIGMA * rng.standard_normal(3)) @ true.rotation
        calibration.learn(turn, se3.log_rotation(seen @ turn.rotation.T), SIGMA ** 2 * np.eye(3))
    return calibration


def test_errors_are_as_large_as_their_covariance(integral):
    rng = np.random.default_rng(1)
    squares, sigmas = [], []
    for _ in range(60):
        bias, offset = 0.001 * rng.standard_normal(3), 0.002 * rng.standard_normal()
        calibration = learned(integral, bias, offset, rng)
        error = calibration.values - [*bias, offset]
        squares.append(error @ np.linalg.solve(calibration.covariance, error))
        sigmas.append(np.sqrt(np.diag(calibration.covariance)))
    # chi-squared with 240 degrees of freedom, by 60: beyond these once in a thousand
    assert 3.0 < np.mean(squares) < 5.2
    assert (np.mean(sigmas, axis=0) < [3e-4, 3e-4, 3e-4, 1e-4]).all()


def test_the_bias_drifts_and_the_offset_does_not():
    calibration = GyroscopeCalibration(ImuSettings(gyroscope_bias_walk=0.01))
    before = np.diag(calibration.covariance).copy()
    calibration.elapse(4.0)
    assert np.diag(calibration.covariance) - before == pytest.approx([4e-4, 4e-4, 4e-4, 0.0])
