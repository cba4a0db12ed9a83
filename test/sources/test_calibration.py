# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Calibration files: what is written is read back, other files are rejected by name."""

import json
import sys

import pytest

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.sources.calibration import CAMERA_FILE, HOW_TO_GIVE, read_camera, write_camera

FIELDS = {'width': 640, 'height': 480, 'k': [500, 0, 320, 0, 501, 240, 0, 0, 1]}


@pytest.mark.parametrize('model, distortion', [
    ('plumb_bob', ()), ('plumb_bob', (0.1, 0.2, 0.3, 0.4)), ('equidistant', (0.0,) * 4),
    ('equidistant', (0.1, 0.2, 0.3, 0.4)),
    ('rational_polynomial', (0.8, -2.7, 0.0004, -0.0003, 1.6, 0.7, -2.5, 1.5))])
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
    ('{"width": 640', r'cannot read the calibration .*: it is not JSON \(.*line 1 column 14.*\): '
     'a file of camera_calibration is read where its name ends with .yaml or .yml$'),
    ('image_width: 640', 'it is not JSON .* ends with .yaml or .yml$'),
    ('', 'cannot read the calibration .*: it is empty$'),
    (json.dumps({**FIELDS, 'k': [float('nan')] * 9}), 'cannot read the calibration .*NaN'),
    (json.dumps({**FIELDS, 'd': [1e200]}), 'cannot read the calibration .*1e'),
    ('[1, 2]', 'not a calibration: required is an object'),
    ('3', 'not a calibration'),
    ('[' * 100_000, 'cannot read the calibration'),
    (json.dumps({**FIELDS, 'width': 10 ** 90}), 'on a side'),
    (json.dumps({**FIELDS, 'width': 10 ** 400}), 'cannot read the calibration'),
    (json.dumps({**FIELDS, 'k': [1e90, *FIELDS['k'][1:]]}), 'focal lengths must be from'),
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
    (json.dumps(FIELDS)[:-1] + ', "k": [1]}', "cannot read .*: it has 'k' twice: remove one"),
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


def test_json_is_read_as_json_and_whole_numbers_may_have_a_point(tmp_path):
    """YAML has no tabs."""
    path = tmp_path / 'camera.json'
    path.write_text(json.dumps({**FIELDS, 'width': 640.0}, indent='\t'))
    assert read_camera(path) == Camera(640, 480, 500, 501, 320, 240)


def test_without_pyyaml_it_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'aick_ros.borders.yaml_text', None)
    (tmp_path / 'head.yaml').write_text(CALIBRATED)
    with pytest.raises(InputError) as raised:
        read_camera(tmp_path / 'head.yaml')
    assert str(raised.value) == (f'cannot read the calibration {tmp_path}/head.yaml: PyYAML is '
                                 'not installed: pip install pyyaml')


@pytest.mark.parametrize('text, sentence', [
    ('3', ' is not a calibration: required is an object with the numbers width and height and '
     'the lists of numbers k and d'),
    ('{"width": 3}', " has no 'height': required are width, height, k (in YAML of "
     'camera_calibration: image_width, image_height, camera_matrix) and, where the image is '
     'distorted, distortion_model and d (distortion_coefficients)')])
def test_what_a_calibration_requires_is_listed(tmp_path, text, sentence):
    (tmp_path / 'camera.json').write_text(text)
    with pytest.raises(InputError) as raised:
        read_camera(tmp_path / 'camera.json')
    assert str(raised.value) == f'{tmp_path}/camera.json{sentence}'


def test_the_example_of_how_to_give_one_is_a_calibration(tmp_path):
    """With numbers in place of its dots; its names are those that are read."""
    example = HOW_TO_GIVE[HOW_TO_GIVE.index('{'):HOW_TO_GIVE.index('}') + 1]
    example = example.replace('nine numbers, row by row', '500, 0, 320, 0, 501, 240, 0, 0, 1')
    example = example.replace('"width": ...', '"width": 640').replace('...]', ']').replace(
        '...', '480')
    (tmp_path / CAMERA_FILE).write_text(example)
    assert read_camera(tmp_path / CAMERA_FILE) == Camera(640, 480, 500, 501, 320, 240)
    assert HOW_TO_GIVE.startswith('put one into the folder as camera.json: {')
    assert HOW_TO_GIVE.endswith(
        '}, or give it, or the YAML of camera_calibration, with --camera FILE (of aick convert, '
        'for commands without this option)')
