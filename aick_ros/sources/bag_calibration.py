# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The calibration of a camera while its bag is read."""

from __future__ import annotations

from contextlib import suppress
from types import SimpleNamespace
from typing import Any

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.messages.camera_info import to_camera

_BACK = 5 * NANOSECONDS
"""Time in which a camera that changes does not change back [ns].

Chosen: a driver is set up for longer, and two of them publish more often."""


class BagCalibration:
    """
    The camera of the latest usable camera_info, as a node has it.

    Where it changes back at once, two drivers publish on one topic: the one that came first
    counts then, as long as it publishes.

    :param camera: that of the first camera_info, or of a file.
    :param topic: of the camera_info; None: the camera never changes.
    :param rectified: whether the images are.
    :param remedy: what to do where two drivers publish, in words.
    :ivar topics: those to be read.
    :ivar remark: that two drivers publish, in one sentence; '' where one does.
    """

    def __init__(self, camera: Camera, topic: str | None, rectified: bool, remedy: str) -> None:
        self.camera, self._rectified, self._remedy = camera, rectified, remedy
        self.topics = [] if topic is None else [topic]
        self.remark = ''
        self._recent = dict[Camera, int]()  # when they were published last [ns], by first time
        self._others = set[Camera]()  # of another driver

    def take(self, topic: str, message: Any, log_time: int) -> None:
        """
        Take a sensor_msgs/CameraInfo of a topic; one that describes no camera has no effect.

        :param log_time: when it was recorded [ns].
        """
        if topic in self.topics:
            with suppress(InputError):
                self._follow(camera_of(message, self._rectified), log_time)

    def _follow(self, camera: Camera, now: int) -> None:
        """Change to a camera that was published now, unless it is another driver's."""
        self._recent = {each: time for each, time in self._recent.items() if now - time < _BACK}
        is_back = camera != self.camera and (
            camera in self._recent or camera in self._others and self.camera in self._recent)
        self._recent[camera] = now
        if is_back:
            camera = next(iter(self._recent))
            self._others |= self._recent.keys() - {camera}
            self.remark = (
                f'{self.topics[0]} alternates between two calibrations, and the first is used: '
                f'let one driver publish it, {self._remedy}')
        self.camera = camera


def camera_of(message: Any, rectified: bool) -> Camera:
    """
    Return the camera of a sensor_msgs/CameraInfo; ROS 1 has its matrices in capital letters.

    :raises InputError: where it describes none.
    """
    if not hasattr(message, 'k'):
        message = SimpleNamespace(**vars(message), k=message.K, d=message.D, p=message.P)
    return to_camera(message, rectified)
