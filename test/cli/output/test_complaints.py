# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sensors that contradict the camera are named, each once, when they begin to."""

from types import SimpleNamespace

from aick_ros.cli.output.complaints import saying_complaints


def test_each_sensor_is_named_once_and_at_the_update_that_shows_it(capfd):
    odometry = SimpleNamespace(gyroscope=SimpleNamespace(complaint=''),
                               gravity=SimpleNamespace(complaint=''))

    def updates():
        yield 0
        odometry.gravity.complaint = 'the accelerometer lies'
        yield 1
        yield 2
        odometry.gravity.complaint = 'it lies otherwise'
        odometry.gyroscope.complaint = 'the gyroscope lies'
        yield 3

    said = [(update, capfd.readouterr().err)
            for update in saying_complaints('desk', odometry, updates())]
    assert said == [(0, ''), (1, 'aick: desk: the accelerometer lies\n'), (2, ''),
                    (3, 'aick: desk: the gyroscope lies\n')]
