# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The camera that a sensor_msgs/CameraInfo message describes.

Only the fields of a message are used, so messages of rclpy and of rosbags both work.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera

_RECTIFIED = re.compile(r'(^|[/_])rect(ified)?([/_]|$)')


class RegionOfInterestMessage(Protocol):
    """The fields of a sensor_msgs/RegionOfInterest that are used [px]."""

    x_offset: int
    y_offset: int
    width: int
    height: int


class CameraInfoMessage(Protocol):
    """The fields of a sensor_msgs/CameraInfo that are used; ``k`` has 9 numbers, ``p`` 12."""

    width: int
    height: int
    distortion_model: str
    d: Sequence[float]
    k: Sequence[float]
    p: Sequence[float]
    binning_x: int
    binning_y: int
    roi: RegionOfInterestMessage


def is_rectified(topic: str) -> bool:
    """Return whether the images of a topic are rectified by its name, as image_proc names them."""
    return _RECTIFIED.search(topic) is not None


def to_camera(message: CameraInfoMessage, rectified: bool = False) -> Camera:
    """
    Return the camera of a message, of the image as it is sent: cropped and binned.

    :param rectified: whether the image is rectified, as ``p`` describes, or raw, as ``k`` and
        ``d`` do.
    :raises InputError: where the fields do not describe a camera.
    """
    if rectified and message.p[0] != 0.0:
        p = np.reshape(message.p, (3, 4))
        camera = Camera.from_camera_info(message.width, message.height, p[:, :3].ravel().tolist())
    else:
        camera = Camera.from_camera_info(message.width, message.height, message.k, message.d,
                                         message.distortion_model)
    if rectified and camera.distortion:
        raise InputError('the images are rectified, and camera_info has no p for them: calibrate '
                         'the camera, or use its raw images (the parameter image_rectification '
                         'says which they are)')
    return _binned(_cropped(camera, message.roi), message.binning_x or 1, message.binning_y or 1)


def _cropped(camera: Camera, roi: RegionOfInterestMessage) -> Camera:
    """Return the camera of a part of the image; a width or height of zero means all of it."""
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
    """Return the camera of an image whose blocks of pixels became one pixel, as image_geometry."""
    return dataclasses.replace(
        camera, width=camera.width // columns, height=camera.height // rows,
        fx=camera.fx / columns, cx=camera.cx / columns, fy=camera.fy / rows, cy=camera.cy / rows)
