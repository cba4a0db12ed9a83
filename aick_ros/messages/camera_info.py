# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The camera that a sensor_msgs/CameraInfo message describes.

Only the fields are looked at, so the messages of rclpy and of rosbags both do.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera

_RECTIFIED = re.compile(r'(^|[/_])rect(ified)?([/_]|$)')


class CameraInfoMessage(Protocol):
    """The fields of a sensor_msgs/CameraInfo that matter here."""

    width: int
    height: int
    distortion_model: str
    d: Sequence[float]
    k: Sequence[float]
    p: Sequence[float]
    binning_x: int
    binning_y: int
    roi: Any


def is_rectified(topic: str) -> bool:
    """Whether a topic's name says that its images are rectified, as image_proc names them."""
    return _RECTIFIED.search(topic) is not None


def to_camera(message: CameraInfoMessage, rectified: bool = False) -> Camera:
    """
    Return the camera of a message, for the image as it is sent: cut out and binned.

    :param rectified: of the rectified image, which ``p`` describes, or of the raw one, which
        ``k`` and ``d`` do.
    :raises InputError: where the fields describe no camera.
    """
    if rectified and message.p[0] != 0.0:
        p = np.reshape(message.p, (3, 4))
        camera = Camera.from_camera_info(message.width, message.height, p[:, :3].ravel())
    else:
        camera = Camera.from_camera_info(message.width, message.height, message.k, message.d,
                                         message.distortion_model)
    if rectified and camera.distortion:
        raise InputError('the images are rectified, and camera_info has no p for them: calibrate '
                         'the camera, or take its raw images (image_rectification says which '
                         'they are)')
    return _binned(_cut_out(camera, message.roi), message.binning_x or 1, message.binning_y or 1)


def _cut_out(camera: Camera, roi: Any) -> Camera:
    """Return the camera of a part of the image; a size of zero stands for all of it."""
    if not roi.width or not roi.height:
        return camera
    if roi.x_offset + roi.width > camera.width or roi.y_offset + roi.height > camera.height:
        raise InputError(
            f'the roi of camera_info, {roi.width} x {roi.height} pixels at {roi.x_offset}, '
            f'{roi.y_offset}, is not within {camera.width} x {camera.height}: check the driver')
    return dataclasses.replace(
        camera, width=roi.width, height=roi.height, cx=camera.cx - roi.x_offset,
        cy=camera.cy - roi.y_offset)


def _binned(camera: Camera, columns: int, rows: int) -> Camera:
    """Return the camera of an image of which so many pixels became one (as image_geometry)."""
    return dataclasses.replace(
        camera, width=camera.width // columns, height=camera.height // rows,
        fx=camera.fx / columns, cx=camera.cx / columns, fy=camera.fy / rows, cy=camera.cy / rows)
