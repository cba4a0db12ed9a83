# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""When an accelerometer follows the camera, from where, and how exact it is said to be."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.accelerometer import Accelerometer
from aick_ros.odometry.inertial.displacement import Limits
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.motion_term import POSITION, MotionTerm
from aick_ros.settings import ImuSettings, OdometrySettings

SETTINGS = ImuSettings(dead_reckoning_sigma=0.4), OdometrySettings()
LIMITS = Limits(0.4, MotionModel(SETTINGS[1]).unknown_speed)
MS = NANOSECONDS // 1000
SIGMA = 0.01  # m


class Played:
    """Gravity and a gyroscope, and what follows the camera by them, along x by 1 m/s."""

    def __init__(self):
        self.stamp, self.is_known, self.begun, self.asked = 100 * MS, True, [], []

    def displacement(self, gyroscope, limits, factor):
        assert gyroscope is self
        self.begun.append((self.stamp, limits, factor))
        return Follower(self, factor) if self.is_known else None


class Follower:
    """Follows the camera for two seconds."""

    def __init__(self, played, factor):
        self._played, self._start, self._factor = played, played.stamp, factor
        self.is_followed, self.reached = True, played.stamp

    def term(self, end):
        self._played.asked.append(end)
        elapsed = (end - self._start) / NANOSECONDS
        self.is_followed = elapsed <= 2.0
        if self.is_followed:
            self.reached = end
        return MotionTerm(se3.exp([elapsed, 0, 0, 0, 0, 0]), POSITION,
                          self._factor * SIGMA ** 2 * np.eye(3))


@pytest.fixture
def played():
    return Played()


@pytest.fixture
def accelerometer(played):
    return Accelerometer(played, played, *SETTINGS)


def seen(played, accelerometer, off=0.0, count=1, interval=500):
    """Let the camera measure displacements that differ by so many standard deviations."""
    for index in range(count + 1):
        pose = se3.exp([1e-3 * interval * index + off * SIGMA * (index % 2), 0, 0, 0, 0, 0])
        accelerometer.learn(played.stamp, pose)
        played.stamp += interval * MS * (index < count)
    played.begun.clear(), played.asked.clear()


def x_of(term):
    return None if term is None else term.T_target_source[0, 3]


def test_it_follows_from_the_last_frame_once(played, accelerometer):
    seen(played, accelerometer)
    start = played.stamp
    assert [x_of(accelerometer.term(start, start + end * MS)) for end in (10, 10, 20)] == (
        pytest.approx([0.01, 0.01, 0.02]))
    assert played.begun == [(start, LIMITS, 1.0)]
    assert played.asked == [start + 10 * MS, start + 20 * MS]


def test_from_each_frame_that_is_measured_it_begins_anew(played, accelerometer):
    seen(played, accelerometer)
    accelerometer.term(played.stamp, played.stamp + 30 * MS)
    played.stamp += 10 * MS
    assert x_of(accelerometer.term(played.stamp, played.stamp + 20 * MS)) == pytest.approx(0.02)
    assert len(played.begun) == 2


def test_a_stamp_before_the_one_asked_last_is_followed_anew(played, accelerometer):
    seen(played, accelerometer)
    accelerometer.term(played.stamp, played.stamp + 20 * MS)
    assert x_of(accelerometer.term(played.stamp, played.stamp + 10 * MS)) == pytest.approx(0.01)
    assert len(played.begun) == 2


@pytest.mark.parametrize('start, end', [(-10, 10), (5, 10), (0, 0), (0, -10)])
def test_of_another_interval_nothing_is_known(played, accelerometer, start, end):
    seen(played, accelerometer)
    assert accelerometer.term(played.stamp + start * MS, played.stamp + end * MS) is None
    assert played.begun == []


def test_where_gravity_is_not_known_nothing_is(played, accelerometer):
    seen(played, accelerometer)
    played.is_known = False
    assert accelerometer.term(played.stamp, played.stamp + MS) is None
    start, played.stamp = played.stamp, None
    assert accelerometer.term(start, start + 2 * MS) is None


@pytest.mark.parametrize('start, end, known', [
    (0, 2000, True), (0, 2001, False), (-10, 10, False)])
def test_it_knows_what_it_follows(played, accelerometer, start, end, known):
    seen(played, accelerometer)
    assert accelerometer.knows(played.stamp + start * MS, played.stamp + end * MS) is known


def test_what_it_has_followed_ends_where_that_is_known(played, accelerometer):
    """It can be asked for again without being followed again."""
    seen(played, accelerometer)
    start = played.stamp
    assert [accelerometer.known_until(start, start + end * MS) - start
            for end in (500, 1500, 2500)] == [500 * MS, 1500 * MS, 1500 * MS]
    assert accelerometer.knows(start, start + 1500 * MS)
    assert not accelerometer.knows(start, start + 2500 * MS)
    assert len(played.begun) == 1
    assert accelerometer.known_until(start - MS, start + MS) == start - MS


@pytest.mark.parametrize('interval, used', [(500, True), (1000, True), (1001, False)])
def test_it_is_used_once_the_camera_has_measured_a_displacement(
        played, accelerometer, interval, used):
    """Of half a second or more; what is longer was a loss."""
    for elapsed in (0, interval // 2 - 1, interval):
        assert not accelerometer.knows(played.stamp, played.stamp + MS)
        played.stamp = (100 + elapsed) * MS
        accelerometer.learn(played.stamp, se3.exp([1e-3 * elapsed, 0, 0, 0, 0, 0]))
    assert accelerometer.knows(played.stamp, played.stamp + MS) is used


@pytest.mark.parametrize('off, factor', [(0.0, 1.0), (1.0, 1.0), (3.0, 3.0), (6.0, 12.0),
                                         (30.0, 100.0)])
def test_it_is_as_exact_as_it_was_lately(played, accelerometer, off, factor):
    """Of three values, of which one is off: a third of its square; at least what is said."""
    seen(played, accelerometer, off, count=40)
    assert accelerometer.factor == pytest.approx(factor)
    accelerometer.term(played.stamp, played.stamp + MS)
    assert played.begun == [(played.stamp, LIMITS, pytest.approx(factor))]


def test_what_it_has_learned_is_a_mean_of_ten(played, accelerometer):
    seen(played, accelerometer, 6.0)
    assert accelerometer.factor == pytest.approx(12.0)
    seen(played, accelerometer, 0.0)
    assert accelerometer.factor == pytest.approx(6.0)
    seen(played, accelerometer, 0.0, count=30)
    assert accelerometer.factor == 1.0


def test_other_settings_count_from_the_next_frame_on(played, accelerometer):
    """What was learned is kept, and what is followed, as through a loss."""
    seen(played, accelerometer, 6.0)
    start = played.stamp
    accelerometer.term(start, start + 10 * MS)
    accelerometer.configure(ImuSettings(dead_reckoning_sigma=0.2), OdometrySettings(max_speed=0.9))
    accelerometer.term(start, start + 20 * MS)
    assert played.begun == [(start, LIMITS, pytest.approx(12.0))]
    played.stamp += 20 * MS
    accelerometer.term(played.stamp, played.stamp + MS)
    assert played.begun[1:] == [(
        played.stamp, Limits(0.2, pytest.approx(0.3)), pytest.approx(12.0))]


def test_after_a_restart_a_frame_of_the_same_stamp_is_another_one(played, accelerometer):
    seen(played, accelerometer)
    for _ in range(2):
        accelerometer.restart()
        accelerometer.term(played.stamp, played.stamp + MS)
    assert len(played.begun) == 2


def test_with_a_limit_of_zero_it_is_not_used(played, accelerometer):
    seen(played, accelerometer)
    accelerometer.configure(ImuSettings(dead_reckoning_sigma=0.0), OdometrySettings())
    assert not accelerometer.knows(played.stamp, played.stamp + MS)


def test_what_is_not_known_is_not_compared(played, accelerometer):
    played.is_known = False
    seen(played, accelerometer, count=3)
    played.is_known = True
    assert not accelerometer.knows(played.stamp, played.stamp + MS)
