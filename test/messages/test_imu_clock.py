# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Another clock of an IMU: from which difference on, and what is no other clock."""

import pytest

from aick_ros.messages.imu_clock import ImuClock

MS = 10 ** 6


@pytest.mark.parametrize('image, newest, difference', [
    (6001, 5000, '1.0 s behind'), (3900, 5000, '1.1 s ahead of'), (6000, 5000, ''),
    (4000, 5000, ''), (5000, 5000, '')])
def test_a_difference_of_more_than_a_second_is_another_clock(image, newest, difference):
    clock = ImuClock()
    assert clock.complaint('/imu') == ''
    clock.compare(image * MS, newest * MS)
    assert clock.complaint('/imu') == (
        f'the samples of the IMU on /imu are stamped {difference} the images and are not used: '
        'let both drivers stamp by one clock' if difference else '')
    clock.compare(newest * MS, newest * MS)
    assert clock.complaint('/imu') == ''


def test_newer_samples_alone_are_no_other_clock():
    """An image may have waited for long."""
    clock = ImuClock()
    for newest in (5, 9005):
        clock.compare(5 * MS, newest * MS)
    assert clock.complaint('/imu') == ''


def test_stamps_that_go_back_with_a_bag_that_loops_are_compared_anew():
    clock = ImuClock()
    clock.compare(9000 * MS, 9000 * MS)
    clock.compare(5 * MS, 5005 * MS)
    assert '5.0 s ahead of the images' in clock.complaint('/imu')


@pytest.mark.parametrize('interval, shift, is_other', [
    (30, 1.05, True), (300, 1.05, True), (1000, 2.9, False), (1000, 3.1, True),
    (5000, 14.0, False), (5000, 16.0, True), (5000, -14.0, False), (5000, -21.0, True)])
def test_the_limit_is_three_intervals_of_a_slow_camera(interval, shift, is_other):
    clock, shift = ImuClock(), round(1000 * shift)
    for image in (100_000, 100_000 + interval):
        clock.compare(image * MS, (image - shift) * MS)
    assert bool(clock.complaint('/imu')) is is_other


def test_a_camera_that_goes_back_with_a_bag_that_loops_is_no_slow_one():
    clock = ImuClock()
    for image in (5, 9000, 5):
        clock.compare(image * MS, (image - 1100) * MS)
    assert '1.1 s behind' in clock.complaint('/imu')
