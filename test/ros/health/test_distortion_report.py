# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What a user reads about distorted depth images, once."""

import numpy as np

from aick_ros.frames.depth_distortion import COLUMNS, NO_DISTORTION, ROWS, DepthDistortion
from aick_ros.ros.health.distortion_report import DistortionReport


def test_nothing_is_reported_of_a_good_camera():
    lines = []
    report = DistortionReport(lines.append)
    report.update(NO_DISTORTION)
    assert lines == []
    assert report.description == 'none'


def test_a_distortion_is_logged_once_and_its_size_is_kept_up_to_date():
    lines = []
    report = DistortionReport(lines.append)
    for size in (0.0, 0.0023, 0.0017):
        report.update(DepthDistortion(np.full((ROWS, COLUMNS), size)))
    sentence, = lines
    assert '2.3 mm' in sentence and 'corrected from now on' in sentence
    assert '1.7 mm' in report.description
    report.update(NO_DISTORTION)
    assert report.description == 'none' and len(lines) == 1
