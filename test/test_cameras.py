# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The files of known cameras: the topics and parameters of the node, and published noise."""

import math
from pathlib import Path

import pytest
import yaml

from aick_ros.cli.input.settings_file import read_settings_file
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


@pytest.mark.parametrize('name, pixels, degrees, baseline, subpixel', [
    ('realsense_d400.yaml', 848, 90.0, 0.05, 0.08), ('oak_d.yaml', 1280, 71.9, 0.075, 0.1)])
def test_the_noise_of_stereo_is_that_of_its_disparity(name, pixels, degrees, baseline, subpixel):
    sensor, z = sensor_of(name), 2.0
    focal_length = pixels / 2 / math.tan(math.radians(degrees / 2))
    disparity = focal_length * baseline / z
    moved = focal_length * baseline / (disparity - subpixel)
    assert sensor.depth_sigma * z ** sensor.depth_exponent == pytest.approx(moved - z, rel=0.03)


def test_the_noise_of_time_of_flight_keeps_below_its_bound():
    sensor = sensor_of('azure_kinect.yaml')
    assert 0.0 <= sensor.depth_exponent <= 1.0
    assert sensor.depth_sigma * 3.5 ** sensor.depth_exponent < 0.017


def test_the_noise_of_the_kinect_is_the_published_one():
    kinect = sensor_of('kinect_v1.yaml')
    # 4 cm at the far end of the range, five metres (Khoshelham and Elberink 2012)
    assert kinect.depth_sigma * 5.0 ** kinect.depth_exponent == pytest.approx(0.04, rel=0.15)


@pytest.mark.parametrize('file', FILES, ids=lambda file: file.stem)
def test_a_file_without_noise_says_so(file):
    text = file.read_text()
    assert 'sensor.depth_sigma: ' in text or 'noise is not set here' in text
