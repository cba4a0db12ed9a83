# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Calibration files: ``camera.json`` with the names of sensor_msgs/CameraInfo, and the YAML of ROS.

The YAML is a file of camera_calibration, as drivers read it, or a camera_info as printed by ``ros2
topic echo``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from aick_ros.borders.bounded_json import bounded_json
from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_CONFIGURATION_BYTES
from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera

_YAML = ('.yaml', '.yml')

CAMERA_FILE = 'camera.json'
"""Name of the calibration file that belongs to a folder."""

BY_OPTION = 'with --camera FILE (of aick convert, for commands without this option)'
"""Way to give a calibration to a command; some have several recordings, others a bag to play."""

HOW_TO_GIVE = (f'put one into the folder as {CAMERA_FILE}: {{"width": ..., "height": ..., '
               '"distortion_model": "plumb_bob", "k": [nine numbers, row by row], "d": [...]}, or '
               f'give it, or the YAML of camera_calibration, {BY_OPTION}')


def read_camera(path: Path) -> Camera:
    """
    Read a calibration file.

    :raises InputError: naming the file, where it cannot be read or does not describe a camera.
    """
    text = read_text(path, 'the calibration', MAX_CONFIGURATION_BYTES)
    try:
        fields = _from_yaml(text) if path.suffix in _YAML else _from_json(text)
    except ValueError as error:  # InputError is one
        raise InputError(f'cannot read the calibration {path}: {error}') from None
    try:
        fields = _as_camera_info(fields)
        return Camera.from_camera_info(
            _whole(fields['width']), _whole(fields['height']), [_number(n) for n in fields['k']],
            [_number(n) for n in fields.get('d', ())], str(fields.get('distortion_model', '')))
    except InputError as error:
        raise InputError(f'{path}: {error}') from None
    except KeyError as error:
        raise InputError(f'{path} has no {error}: required are width, height, k (in YAML of '
                         'camera_calibration: image_width, image_height, camera_matrix) and, '
                         'where the image is distorted, distortion_model and d '
                         '(distortion_coefficients)') from None
    except (TypeError, ValueError, AttributeError, OverflowError):
        raise InputError(f'{path} is not a calibration: required is an object with the numbers '
                         'width and height and the lists of numbers k and d') from None


def _number(value: Any) -> float:
    if isinstance(value, bool):
        raise TypeError
    return float(value)


def _whole(value: Any) -> int:
    if isinstance(value, bool) or isinstance(value, float) and not value.is_integer():
        raise TypeError
    return int(value)


def _from_json(text: str) -> Any:
    """Return the content; ValueError where the text is not JSON."""
    try:
        return bounded_json(text)
    except json.JSONDecodeError as error:
        raise InputError(f'it is not JSON ({error}): a file of camera_calibration is read where '
                         f'its name ends with {" or ".join(_YAML)}') from None


def _from_yaml(text: str) -> Any:
    """Return the first document; InputError where the text is not YAML."""
    try:
        from aick_ros.borders.yaml_text import parse_yaml
    except ModuleNotFoundError:
        raise InputError('PyYAML is not installed: pip install pyyaml') from None
    return parse_yaml(text)


def _as_camera_info(fields: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return fields with the names of sensor_msgs/CameraInfo."""
    if 'camera_matrix' not in fields:
        return fields
    coefficients = fields.get('distortion_coefficients') or {'data': ()}
    return {'width': fields['image_width'], 'height': fields['image_height'],
            'k': fields['camera_matrix']['data'], 'd': coefficients['data'],
            'distortion_model': fields.get('distortion_model', '')}


def write_camera(path: Path, camera: Camera) -> None:
    """Write a calibration file, which :func:`read_camera` reads back without loss."""
    fields = {'width': camera.width, 'height': camera.height,
              'distortion_model': camera.distortion_model,
              'k': camera.matrix.ravel().tolist(), 'd': list(camera.distortion)}
    path.write_text(json.dumps(fields, indent=2) + '\n')
