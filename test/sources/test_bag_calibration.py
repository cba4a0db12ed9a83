# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera that changes in a bag, and one that two drivers describe."""

import pytest

from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.sources.bag_calibration import BagCalibration
from aick_ros.sources.writers.bag_messages import camera_info

CAMERAS = {name: Camera(320, 240, 100.0 + index, 100.0, 160.0, 120.0)
           for index, name in enumerate('ABC')}
TOPIC = '/rgb/camera_info'


def used(published, interval):
    """Return the cameras that count after each message, and what is remarked after the last."""
    calibration = BagCalibration(CAMERAS[published[0]], TOPIC, False, 'or do that')
    names = {camera: name for name, camera in CAMERAS.items()}
    found = ''
    for index, name in enumerate(published):
        now = round((1000 + index * interval) * NANOSECONDS)
        calibration.take(TOPIC, camera_info(now, CAMERAS[name]), now)
        calibration.take('/other/camera_info', camera_info(now, CAMERAS['C']), now)
        found += names[calibration.camera]
    return found, calibration.remark


@pytest.mark.parametrize('interval', [1 / 30, 1.0])
@pytest.mark.parametrize('published, expected', [
    ('ABABABAB', 'ABAAAAAA'), ('AAAABAAAABAAAA', 'AAAABAAAAAAAAA'), ('AABBAABB', 'AABBAAAA'),
    ('AAAABAAAAAAABAA', 'AAAABAAAAAAAAAA'), ('ABCABC', 'ABCAAA')])
def test_of_two_drivers_the_first_one_counts(published, expected, interval):
    found, remark = used(published, interval)
    assert found == expected
    assert remark == ('/rgb/camera_info alternates between two calibrations, and the first is '
                      'used: let one driver publish it, or do that')


@pytest.mark.parametrize('published, interval', [
    ('AAABBB', 1 / 30), ('ABC', 1 / 30), ('ABAB', 6.0), ('A', 1.0),
    (200 * 'A' + 200 * 'B' + 200 * 'A', 1 / 30)])
def test_a_camera_that_changes_for_longer_is_followed(published, interval):
    assert used(published, interval) == (published, '')


def test_where_the_first_driver_ends_the_other_one_counts():
    found, remark = used(5 * 'AB' + 10 * 'B', 1.0)
    assert found[:10] == 'ABAAAAAAAA' and found[-1] == 'B' and remark
    assert found.rstrip('B') == found[:13]  # five seconds after the last one of the first
