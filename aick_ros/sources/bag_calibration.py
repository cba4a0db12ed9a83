# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The calibration of a camera while its bag is read."""

from __future__ import annotations

from contextlib import suppress
from types import SimpleNamespace
from typing import Any

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.messages.camera_info import to_camera


class BagCalibration:
    """
    The camera of the latest usable camera_info, as a node has it.

    :param camera: that of the first camera_info, or of a file.
    :param topic: of the camera_info; None: the camera never changes.
    :param rectified: whether the images are.
    :ivar topics: those to be read.
    """

    def __init__(self, camera: Camera, topic: str | None, rectified: bool) -> None:
        self.camera, self._rectified = camera, rectified
        self.topics = [] if topic is None else [topic]

    def take(self, topic: str, message: Any) -> None:
        """Take a sensor_msgs/CameraInfo of a topic; one that describes no camera has no effect."""
        if topic in self.topics:
            with suppress(InputError):
                self.camera = camera_of(message, self._rectified)


def camera_of(message: Any, rectified: bool) -> Camera:
    """
    Return the camera of a sensor_msgs/CameraInfo; ROS 1 has its matrices in capital letters.

    :raises InputError: where it describes none.
    """
    if not hasattr(message, 'k'):
        message = SimpleNamespace(**vars(message), k=message.K, d=message.D, p=message.P)
    return to_camera(message, rectified)
