# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sensors that are not used are named, and a plane that is none, when it shows."""

from types import SimpleNamespace

import pytest

from aick_ros.odometry.complaints import reporting_complaints


def test_each_reason_is_named_once_and_at_the_update_that_shows_it():
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
    first, *others = ('the accelerometer lies', 'the gyroscope lies', 'it lies otherwise',
                      'there is no plane')
    assert seen == [(0, []), (1, [first]), (2, [first]), (3, [first, *others[:2]]),
                    (4, [first, *others])]


@pytest.mark.parametrize('sentences', [
    ('it reports (0, -1, 0) m/s^2 for 0.6 s', 'it reports (1e-05, nan, 3) m/s^2 for 9 s'),
    ('the gyroscope turns by 3.0 deg', 'the gyroscope turns by -17.2 deg')])
def test_a_reason_with_other_numbers_is_no_other_one(sentences):
    gravity = SimpleNamespace(complaint='')
    odometry = SimpleNamespace(gyroscope=SimpleNamespace(complaint=''), gravity=gravity,
                               plane=SimpleNamespace(complaint=''))

    def updates():
        for sentence in (*sentences, '', *sentences, 'the accelerometer contradicts the camera'):
            gravity.complaint = sentence
            yield sentence
    said = list[str]()
    list(reporting_complaints(odometry, updates(), said.append))
    assert said == [sentences[0], 'the accelerometer contradicts the camera']
