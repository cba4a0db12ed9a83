# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""When an accelerometer follows the camera, and from where."""

import pytest

from aick_ros.odometry.inertial.accelerometer import Accelerometer


class Played:
    """Gravity and a gyroscope, and what follows the camera by them."""

    def __init__(self):
        self.stamp, self.is_known = 100, True
        self.begun, self.asked = [], []

    def displacement(self, gyroscope, speed):
        self.begun.append((self.stamp, gyroscope, speed))
        return Follower(self) if self.is_known else None


class Follower:
    """Follows the camera up to the stamp 120."""

    def __init__(self, played):
        self._played, self._start, self.is_followed = played, played.stamp, True

    def term(self, end):
        self._played.asked.append(end)
        self.is_followed = end <= 120
        return self._start, end


@pytest.fixture
def played():
    return Played()


@pytest.fixture
def accelerometer(played):
    return Accelerometer(played, played, 0.7)


def test_it_follows_from_the_last_frame_once(played, accelerometer):
    assert [accelerometer.term(100, end) for end in (110, 110, 120)] == [
        (100, 110), (100, 110), (100, 120)]
    assert played.begun == [(100, played, 0.7)] and played.asked == [110, 120]


def test_from_each_frame_that_is_measured_it_begins_anew(played, accelerometer):
    accelerometer.term(100, 110)
    played.stamp = 110
    assert accelerometer.term(110, 120) == (110, 120)
    assert len(played.begun) == 2


def test_a_stamp_before_the_one_asked_last_is_followed_anew(played, accelerometer):
    accelerometer.term(100, 120)
    assert accelerometer.term(100, 110) == (100, 110)
    assert len(played.begun) == 2


@pytest.mark.parametrize('start, end', [(90, 110), (105, 110), (100, 100), (100, 90)])
def test_of_another_interval_nothing_is_known(played, accelerometer, start, end):
    assert accelerometer.term(start, end) is None
    assert played.begun == []


def test_where_gravity_is_not_known_nothing_is(played, accelerometer):
    played.is_known = False
    assert accelerometer.term(100, 110) is None
    played.stamp = None
    assert accelerometer.term(100, 120) is None


@pytest.mark.parametrize('start, end, known', [
    (100, 120, True), (100, 121, False), (90, 110, False)])
def test_it_knows_what_it_follows(accelerometer, start, end, known):
    assert accelerometer.knows(start, end) is known
