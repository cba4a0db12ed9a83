# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a user reads about a misaligned camera and distorted depth images, once."""

import numpy as np
import pytest

from aick_ros.frames.depth_distortion import COLUMNS, NO_DISTORTION, ROWS, DepthDistortion
from aick_ros.registration.refinement.misalignment import NO_MISALIGNMENT, Misalignment
from aick_ros.ros.health.camera_report import CameraReport

OFFSET = np.array([0.026, -0.001, 0.004, *np.radians([0.3, -1.25, 0.5])])


def distortion(size):
    return DepthDistortion(np.full((ROWS, COLUMNS), size))


@pytest.fixture
def lines():
    return []


@pytest.fixture
def report(lines):
    return CameraReport(lines.append)


def test_nothing_is_reported_of_a_good_camera(report, lines):
    for _ in range(2):
        assert (report.misalignment, report.distortion) == ('none', 'none')
        report.update(NO_MISALIGNMENT, NO_DISTORTION)
    assert lines == []


def test_a_misalignment_that_is_known_is_not_reported_as_found(report, lines):
    for _ in range(2):
        report.update(Misalignment(OFFSET, -0.018, 0.02, 0.0), NO_DISTORTION)
    assert lines == []
    assert '18 ms earlier' in report.misalignment
    report.update(NO_MISALIGNMENT, NO_DISTORTION)
    sentence, = lines
    assert 'is not there' in sentence


def test_a_misalignment_is_logged_once_and_its_numbers_are_kept_up_to_date(report, lines):
    report.update(NO_MISALIGNMENT, NO_DISTORTION)
    for delay in (-0.018, -0.023):
        report.update(Misalignment(OFFSET, delay, 0.02, 0.0), NO_DISTORTION)
    sentence, = lines
    for part in ('(0.30, -1.25, 0.50) deg', '(26, -1, 4) mm', '18 ms earlier', '20 ms'):
        assert part in sentence
    assert '23 ms earlier' in report.misalignment
    report.update(Misalignment(np.zeros(6), 0.012, 0.0, 0.0), NO_DISTORTION)
    assert report.misalignment == 'depth images are taken 12 ms later than their stamps say'


def test_a_distortion_is_logged_once_and_its_size_is_kept_up_to_date(report, lines):
    for size in (0.0, 0.0023, 0.0017):
        report.update(NO_MISALIGNMENT, distortion(size))
    sentence, = lines
    assert '2.3 mm' in sentence and 'corrected from now on' in sentence
    assert '1.7 mm' in report.distortion
    report.update(NO_MISALIGNMENT, NO_DISTORTION)
    assert report.distortion == 'none' and len(lines) == 1


def test_of_a_camera_with_both_each_is_logged(report, lines):
    report.update(NO_MISALIGNMENT, NO_DISTORTION)
    report.update(Misalignment(OFFSET, -0.018, 0.02, 0.0), NO_DISTORTION)
    report.update(Misalignment(OFFSET, -0.018, 0.02, 0.0), distortion(0.0023))
    assert ['18 ms' in line for line in lines] == [True, False]
    assert ['2.3 mm' in line for line in lines] == [False, True]
