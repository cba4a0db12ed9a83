# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Whether a force that never changes is that of a sensor without noise, by what is beside it."""

import numpy as np
import pytest

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.rest_check import RestCheck
from aick_ros.odometry.inertial.sample_check import SampleCheck

PERIOD = NANOSECONDS // 100
UP = np.array([0.48, -0.8, -0.36])
SMALL = 0.01
NONE = np.full((100, 3), np.nan)


class Sensor:
    """An accelerometer, and its check."""

    def __init__(self):
        self.samples = SampleCheck('accelerometer', 'm/s^2', 400.0)
        self.check = RestCheck(self.samples)
        self.stamp = 0

    def add(self, force=9.8 * UP, rates=NONE):
        """Add samples of a force, 3, for a second."""
        stamps = self.stamp + PERIOD * np.arange(1, 101)
        self.stamp = int(stamps[-1])
        samples = ImuSamples(stamps, rates, np.tile(force, (100, 1)))
        self.samples.usable(samples.stamps, samples.accelerations)
        self.check.add(samples)
        return self.check.doubt

    def see(self, translation=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0), late=0, sigma=1e-3):
        """Note a pose at the last sample, or later [ns]."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = se3.exp_rotation(turn), translation
        self.check.note(self.stamp + late, PoseWithCovariance(pose, sigma ** 2 * np.eye(6)))
        return self.check.doubt


@pytest.fixture
def sensor():
    return Sensor()


@pytest.mark.parametrize('length, doubt', [
    (9.8, SMALL), (9.80665, SMALL), (9.81, SMALL), (9.7995, SMALL), (9.8035, 1.0), (9.7985, 1.0),
    (9.8115, 1.0), (1.0, 1.0), (0.0, 1.0)])
def test_without_noise_its_length_is_the_gravity_of_a_simulator(sensor, length, doubt):
    assert sensor.check.doubt == 0.0
    assert sensor.add(length * UP) == doubt
    assert sensor.see() == doubt


def test_a_gyroscope_without_noise_is_constant_at_some_time(sensor):
    noisy = np.random.default_rng(0).normal(0.0, 0.01, (100, 3))
    assert sensor.add(rates=noisy) == 1.0
    assert sensor.add(rates=np.zeros((100, 3))) == SMALL
    assert sensor.add(rates=noisy) == SMALL  # it turns, about what is up


@pytest.mark.parametrize('motion, doubt', [
    ({}, SMALL), ({'translation': (0.0, 0.02, 0.0)}, SMALL),
    ({'translation': (0.0, 0.04, 0.0)}, 1.0), ({'turn': np.radians([1.0, 0.0, 0.0])}, SMALL),
    ({'turn': np.radians([2.5, 0.0, 0.0])}, 1.0), ({'turn': np.radians(80.0) * UP}, SMALL),
    ({'translation': (0.0, 0.04, 0.0), 'late': 1}, SMALL),
    ({'translation': (0.0, 0.04, 0.0), 'sigma': 0.01}, SMALL)],
    ids=['at rest', 'by noise', 'moved', 'tilted by noise', 'tilted', 'turned about what is up',
         'after the last sample', 'by noise that is known'])
def test_of_a_camera_that_tilts_or_moves_the_value_changes(sensor, motion, doubt):
    sensor.add()
    sensor.see()
    assert sensor.see(**motion) == doubt
    assert sensor.see() == doubt  # it has moved, though it is back


def test_a_gyroscope_shows_noise_only_after_as_long_as_a_constant_one_takes(sensor):
    """One that begins later than the accelerometer is constant for a shorter time."""
    late = np.zeros((100, 3))
    late[:60] = np.nan
    assert sensor.add(rates=late) == SMALL
    assert sensor.add(rates=np.zeros((100, 3))) == SMALL


def test_a_pose_after_the_last_sample_is_judged_once_the_next_ones_come(sensor):
    sensor.add()
    sensor.see()
    assert sensor.see((0.1, 0.0, 0.0), late=PERIOD // 2) == SMALL
    assert sensor.add() == 1.0


def test_a_motion_counts_for_the_value_of_that_time(sensor):
    sensor.add()
    sensor.see()
    sensor.see((0.1, 0.0, 0.0))
    assert sensor.add(9.81 * UP) == SMALL
    assert sensor.see((0.2, 0.0, 0.0)) == SMALL  # where it rests now


def test_poses_that_are_measured_anew_are_not_compared_with_those_before(sensor):
    sensor.add()
    sensor.see()
    sensor.check.restart()
    assert sensor.see((0.1, 0.0, 0.0)) == SMALL
    sensor.see()
    sensor.check.restart()
    assert sensor.check.doubt == 1.0
