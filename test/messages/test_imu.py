# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages of an IMU to samples."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.borders.limits import MAX_ACCELERATION, MAX_TURN_RATE
from aick_ros.geometry import se3
from aick_ros.messages.imu import ImuBuffer


def vector(x, y, z):
    return SimpleNamespace(x=x, y=y, z=z)


def message(rate=(1.0, 2.0, 3.0), force=(4.0, 5.0, 6.0), has_rate=True, has_force=True):
    covariances = [np.full(9, 0.0 if has else -1.0) for has in (has_rate, has_force)]
    return SimpleNamespace(
        header=SimpleNamespace(frame_id='imu'),
        angular_velocity=vector(*rate), angular_velocity_covariance=covariances[0],
        linear_acceleration=vector(*force), linear_acceleration_covariance=covariances[1])


def test_samples_are_taken_once_in_the_axes_of_the_camera():
    buffer = ImuBuffer()
    assert buffer.newest is None and len(buffer.take(np.eye(4))) == 0
    buffer.add(1_000_000_007, message())
    buffer.add(2_000_000_007, message(rate=(0.0, 0.0, 0.0)))
    assert (buffer.newest, buffer.frame_id) == (2_000_000_007, 'imu')
    samples = buffer.take(se3.exp([0.0, 0, 0, 0, 0, np.pi / 2]))
    assert samples.stamps.tolist() == [1_000_000_007, 2_000_000_007]
    assert np.allclose(samples.turn_rates, [[-2, 1, 3], [0, 0, 0]])
    assert np.allclose(samples.accelerations, 2 * [[-5, 4, 6]])
    assert len(buffer.take(np.eye(4))) == 0


def test_what_is_not_measured_is_nan():
    buffer = ImuBuffer()
    for kind in ({'has_rate': False}, {'has_force': False}, {'force': (0.0, 0.0, 0.0)}):
        buffer.add(1_000_000_007, message(**kind))
    samples = buffer.take(np.eye(4))
    assert np.isnan(samples.turn_rates).all(axis=1).tolist() == [True, False, False]
    assert np.isnan(samples.accelerations).all(axis=1).tolist() == [False, True, True]


@pytest.mark.parametrize('value', [np.inf, -np.inf, np.nan, 1e300, -1e6])
def test_what_no_sensor_reaches_is_not_measured(value):
    buffer = ImuBuffer()
    buffer.add(7, message(rate=(0.0, value, 0.0)))
    buffer.add(8, message(force=(0.0, 9.8, value)))
    buffer.add(9, message(rate=(0.0, -70.0, 0.0), force=(0.0, 9.8, -2e4)))
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        samples = buffer.take(np.eye(4))
    assert np.isnan(samples.turn_rates).all(axis=1).tolist() == [True, False, False]
    assert np.isnan(samples.accelerations).all(axis=1).tolist() == [False, True, False]


def test_the_oldest_samples_are_forgotten():
    buffer = ImuBuffer()
    for i in range(60_002):
        buffer.add(i * 1_000_000_000 + 7, message())
    assert buffer.take(np.eye(4)).stamps[[0, -1]].tolist() == [2_000_000_007, 60_001_000_000_007]


@pytest.mark.parametrize('axis', range(3))
@pytest.mark.parametrize('sign', [1, -1])
def test_what_the_limits_allow_is_measured(axis, sign):
    """Each of its own sensor, and to the last bit."""
    buffer = ImuBuffer()
    for is_within in (True, False):
        rate, force = np.zeros(3), np.array([0.0, 9.8, 0.0])
        rate[axis], force[axis] = (
            sign * (limit if is_within else np.nextafter(limit, np.inf))
            for limit in (MAX_TURN_RATE, MAX_ACCELERATION))
        buffer.add(1, message(rate=rate.tolist()))
        buffer.add(2, message(force=force.tolist()))
    samples = buffer.take(np.eye(4))
    assert np.isnan(samples.turn_rates).all(axis=1).tolist() == [False, False, True, False]
    assert np.isnan(samples.accelerations).all(axis=1).tolist() == [False, False, False, True]


def test_the_first_covariance_alone_says_that_nothing_is_measured():
    for index in range(9):
        buffer, given = ImuBuffer(), message()
        given.angular_velocity_covariance[index] = -1.0
        given.linear_acceleration_covariance[index] = -1.0
        buffer.add(1, given)
        samples = buffer.take(np.eye(4))
        assert np.isnan(samples.turn_rates).all() == (index == 0)
        assert np.isnan(samples.accelerations).all() == (index == 0)


def test_an_imu_that_measures_nothing_is_described_until_it_does():
    """One of its two sensors suffices, and some drivers begin with a few samples of none."""
    buffer, nothing = ImuBuffer(), (np.nan, 0.0, 0.0)
    for stamp in range(99):
        buffer.add(stamp, message(rate=nothing, force=nothing))
    assert buffer.complaint('/imu') == ''
    buffer.add(99, message(has_rate=False, has_force=False))
    assert buffer.complaint('/imu').startswith('the last 100 samples of the IMU on /imu have')
    for changes in ({'force': nothing}, {'rate': nothing}):
        buffer.add(100, message(**changes))
        assert buffer.complaint('/imu') == ''
