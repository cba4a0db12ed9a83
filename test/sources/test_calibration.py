# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Calibration files: what is written is read back, other files are rejected by name."""

import json

import pytest

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.sources.calibration import read_camera, write_camera

FIELDS = {'width': 640, 'height': 480, 'k': [500, 0, 320, 0, 501, 240, 0, 0, 1]}


@pytest.mark.parametrize('model, distortion', [
    ('plumb_bob', ()), ('plumb_bob', (0.1, 0.2, 0.3, 0.4)), ('equidistant', (0.0,) * 4),
    ('equidistant', (0.1, 0.2, 0.3, 0.4)), ('rational_polynomial', tuple(range(1, 9)))])
def test_a_camera_comes_back(tmp_path, model, distortion):
    camera = Camera(640, 480, 517.306408, 516.469215, 1 / 3, 255.313989, model, distortion)
    write_camera(tmp_path / 'camera.json', camera)
    assert read_camera(tmp_path / 'camera.json') == camera


def test_names_are_those_of_camera_info(tmp_path):
    write_camera(tmp_path / 'camera.json', Camera(64, 48, 50, 51, 32, 24))
    assert json.loads((tmp_path / 'camera.json').read_text()) == {
        'width': 64, 'height': 48, 'distortion_model': 'plumb_bob',
        'k': [50, 0, 32, 0, 51, 24, 0, 0, 1], 'd': []}


def test_distortion_is_optional(tmp_path):
    (tmp_path / 'c.json').write_text(json.dumps(FIELDS))
    assert read_camera(tmp_path / 'c.json') == Camera(640, 480, 500, 501, 320, 240)


@pytest.mark.parametrize('text, reason', [
    ('{"width": 640', 'cannot read the calibration'),
    ('[1, 2]', 'not a calibration: required is an object'),
    ('3', 'not a calibration'),
    ('[' * 100_000, 'cannot read the calibration'),
    (json.dumps({**FIELDS, 'width': 10 ** 400}), 'on a side'),
    (json.dumps({**FIELDS, 'k': [1e300, *FIELDS['k'][1:]]}), 'focal lengths must be from'),
    (' ' * 300_000, 'larger than 262144 bytes'),
    (json.dumps({**FIELDS, 'k': 'abc'}), 'not a calibration'),
    (json.dumps({**FIELDS, 'k': [None] * 9}), 'not a calibration'),
    (json.dumps({**FIELDS, 'k': ['a'] * 9}), 'not a calibration'),
    (json.dumps({**FIELDS, 'width': 'wide'}), 'not a calibration'),
    (json.dumps({**FIELDS, 'width': 640.5}), 'not a calibration'),
    (json.dumps({**FIELDS, 'width': True}), 'not a calibration'),
    (json.dumps({**FIELDS, 'k': [True] * 9}), 'not a calibration'),
    (json.dumps({**FIELDS, 'k': [1, 2, 3]}), 'k of camera_info has 3 numbers'),
    (json.dumps({**FIELDS, 'k': [0] * 9}), 'not calibrated'),
    (json.dumps({**FIELDS, 'd': [0.1]}), 'has 1 coefficients'),
    (json.dumps({**FIELDS, 'distortion_model': 'magic'}), "unknown distortion model 'magic'"),
    (json.dumps({key: FIELDS[key] for key in ('width', 'k')}), "has no 'height'"),
])
def test_a_file_without_a_calibration_is_rejected(tmp_path, text, reason):
    path = tmp_path / 'camera.json'
    path.write_text(text)
    with pytest.raises(InputError, match=reason) as caught:
        read_camera(path)
    assert str(path) in str(caught.value)


CALIBRATED = '''
image_width: 640
image_height: 480
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [500.5, 0, 320, 0, 501, 240, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [0.1, -0.2, 0.001, 0.002, 0.3]
projection_matrix:
  rows: 3
  cols: 4
  data: [400, 0, 310, 0, 0, 400, 230, 0, 0, 0, 1, 0]
'''
ECHOED = '''
height: 480
width: 640
distortion_model: plumb_bob
d:
- 0.1
- -0.2
- 0.001
- 0.002
- 0.3
k: [500.5, 0.0, 320.0, 0.0, 501.0, 240.0, 0.0, 0.0, 1.0]
---
'''


@pytest.mark.parametrize('name', ['head.yaml', 'head.yml'])
@pytest.mark.parametrize('text', [CALIBRATED, ECHOED])
def test_yaml_of_ros(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    assert read_camera(tmp_path / name) == Camera(
        640, 480, 500.5, 501, 320, 240, 'plumb_bob', (0.1, -0.2, 0.001, 0.002, 0.3))


@pytest.mark.parametrize('text, reason', [
    ('image_width: [', 'cannot read the calibration .*: it is not YAML'),
    ('', 'not a calibration'),
    ('- ' * 900, 'deeper than 32 levels'),
    ('&a {k: *a}', 'an alias to itself'),
    (CALIBRATED.replace('image_width', 'breadth'), "has no 'image_width': .* image_height"),
    (CALIBRATED.replace('data', 'numbers'), "has no 'data'"),
    (CALIBRATED.replace('camera_matrix:', 'camera_matrix: 3'), 'it is not YAML'),
])
def test_yaml_without_a_calibration_is_rejected(tmp_path, text, reason):
    (tmp_path / 'head.yaml').write_text(text)
    with pytest.raises(InputError, match=reason):
        read_camera(tmp_path / 'head.yaml')


def test_distortion_is_optional_in_yaml(tmp_path):
    (tmp_path / 'head.yaml').write_text(CALIBRATED[:CALIBRATED.index('distortion_model')])
    assert read_camera(tmp_path / 'head.yaml') == Camera(640, 480, 500.5, 501, 320, 240)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match='cannot read the calibration .*nowhere.json'):
        read_camera(tmp_path / 'nowhere.json')
