# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The files of known cameras: the node's topics, and parameters that it takes."""

from pathlib import Path

import pytest
import yaml

from aick_ros.cli.settings_file import read_settings_file
from aick_ros.settings import Settings

FOLDER = Path(__file__).parents[1] / 'config' / 'cameras'
FILES = sorted(FOLDER.glob('*.yaml'))


def sensor_of(name):
    return read_settings_file(FOLDER / name).applied_to(Settings()).sensor


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.stem)
def test_the_topics_are_those_of_the_node(file):
    content = yaml.safe_load(file.read_text())
    assert set(content['remappings']) == {'rgb/image', 'depth/image', 'rgb/camera_info'}
    assert set(content) <= {'remappings', '/**'}


def test_the_noise_is_the_published_one():
    kinect, d435 = sensor_of('kinect_v1.yaml'), sensor_of('realsense_d400.yaml')
    # 4 cm at the far end of the range, five metres (Khoshelham and Elberink 2012)
    assert kinect.depth_sigma * 5.0 ** kinect.depth_exponent == pytest.approx(0.04, rel=0.15)
    # a disparity off by 0.08 px, of 848 px over 90 degrees and 50 mm
    disparity = 424.0 * 0.05 / 2.0
    moved = 424.0 * 0.05 / (disparity - 0.08)
    assert d435.depth_sigma * 2.0 ** d435.depth_exponent == pytest.approx(moved - 2.0, rel=0.02)
