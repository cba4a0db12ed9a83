# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a user reads about a misaligned camera, once."""

import numpy as np

from aick_ros.registration.refinement.misalignment import NO_MISALIGNMENT, Misalignment
from aick_ros.ros.health.misalignment_report import MisalignmentReport

OFFSET = np.array([0.026, -0.001, 0.004, *np.radians([0.3, -1.25, 0.5])])


def test_nothing_is_reported_of_a_good_camera():
    lines = []
    report = MisalignmentReport(lines.append)
    report.update(NO_MISALIGNMENT)
    assert lines == []
    assert report.description == 'none'


def test_a_misalignment_that_is_known_is_not_reported_as_found():
    lines = []
    report = MisalignmentReport(lines.append)
    for _ in range(2):
        report.update(Misalignment(OFFSET, -0.018, 0.02))
    assert lines == []
    assert '18 ms earlier' in report.description
    report.update(NO_MISALIGNMENT)
    sentence, = lines
    assert 'is not there' in sentence


def test_a_misalignment_is_logged_once_and_its_numbers_are_kept_up_to_date():
    lines = []
    report = MisalignmentReport(lines.append)
    report.update(NO_MISALIGNMENT)
    for delay in (-0.018, -0.023):
        report.update(Misalignment(OFFSET, delay, 0.02))
    sentence, = lines
    for part in ('(0.30, -1.25, 0.50) deg', '(26, -1, 4) mm', '18 ms earlier', '20 ms'):
        assert part in sentence
    assert '23 ms earlier' in report.description
    report.update(Misalignment(np.zeros(6), 0.012, 0.0))
    assert report.description == 'depth images are taken 12 ms later than their stamps say'
