# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sensors that are not used are named, and a plane that is none, each once, when it shows."""

from types import SimpleNamespace

from aick_ros.odometry.complaints import reporting_complaints


def test_each_sensor_is_named_once_and_at_the_update_that_shows_it():
    odometry = SimpleNamespace(gyroscope=SimpleNamespace(complaint=''),
                               gravity=SimpleNamespace(complaint=''),
                               plane=SimpleNamespace(complaint=''))

    def updates():
        yield 0
        odometry.gravity.complaint = 'the accelerometer lies'
        yield 1
        yield 2
        odometry.gravity.complaint = 'it lies otherwise'
        odometry.gyroscope.complaint = 'the gyroscope lies'
        yield 3
        odometry.plane.complaint = 'there is no plane'
        yield 4

    said = list[str]()
    seen = [(update, list(said))
            for update in reporting_complaints(odometry, updates(), said.append)]
    accelerometer, gyroscope = 'the accelerometer lies', 'the gyroscope lies'
    assert seen == [(0, []), (1, [accelerometer]), (2, [accelerometer]),
                    (3, [accelerometer, gyroscope]),
                    (4, [accelerometer, gyroscope, 'there is no plane'])]
