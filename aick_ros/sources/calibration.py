# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The calibration file ``camera.json``: a camera under the names of sensor_msgs/CameraInfo."""

from __future__ import annotations

import json
from pathlib import Path

from aick_ros.camera import Camera
from aick_ros.errors import InputError

CAMERA_FILE = 'camera.json'
"""Name of the calibration file that belongs to a folder."""

HOW_TO_GIVE = (f'give one with --camera FILE, or put it into the folder as {CAMERA_FILE}: '
               '{"width": ..., "height": ..., "distortion_model": "plumb_bob", '
               '"k": [nine numbers, row by row], "d": [...]}')


def read_camera(path: Path) -> Camera:
    """
    Read a calibration file.

    :raises InputError: naming the file, where it cannot be read or describes no camera.
    """
    try:
        fields = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise InputError(f'cannot read the calibration {path}: {error}') from None
    try:
        return Camera.from_camera_info(
            int(fields['width']), int(fields['height']), [float(n) for n in fields['k']],
            [float(n) for n in fields.get('d', ())], str(fields.get('distortion_model', '')))
    except InputError as error:
        raise InputError(f'{path}: {error}') from None
    except KeyError as error:
        raise InputError(f'{path} has no {error}: it takes width, height, k and, where the image '
                         'is distorted, distortion_model and d') from None
    except (TypeError, ValueError, AttributeError, OverflowError):
        raise InputError(f'{path} is no calibration: it takes an object with the numbers width '
                         'and height and the lists of numbers k and d') from None


def write_camera(path: Path, camera: Camera) -> None:
    """Write a calibration file, which :func:`read_camera` reads back without loss."""
    fields = {'width': camera.width, 'height': camera.height,
              'distortion_model': camera.distortion_model,
              'k': camera.matrix.ravel().tolist(), 'd': list(camera.distortion)}
    path.write_text(json.dumps(fields, indent=2) + '\n')
