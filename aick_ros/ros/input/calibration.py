# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The calibration of a camera, as its camera_info describes it."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from rclpy.node import Node
from sensor_msgs.msg import CameraInfo

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.messages.camera_info import is_rectified, to_camera
from aick_ros.ros.input.subscriptions import camera_info_subscription, image_topics
from aick_ros.settings.node import NodeSettings

_THROTTLE = 5.0  # seconds between two log lines of the same kind; chosen
_MOST_CHANGES = 3  # of the camera in this time; chosen: a driver is set up once


class Calibration:
    """
    The latest usable camera_info, of a topic or of a part of rgbd_image.

    :param name: unresolved name of the camera_info topic.
    :param image: unresolved name of the topic of the images that it describes.
    :param on_change: called when the camera is another one than before.
    :ivar camera: the camera; None until a usable message was received.
    :ivar source: name of the topic, or of the part of rgbd_image, unresolved.
    :ivar subscription: None where it is a part of rgbd_image.
    """

    def __init__(self, node: Node, name: str, image: str, settings: NodeSettings,
                 on_change: Callable[[], None]) -> None:
        self._logger, self._on_change = node.get_logger(), on_change
        self.camera: Camera | None = None
        self._rejection = ''
        self._changes = deque[float](maxlen=_MOST_CHANGES)  # steady times [s]
        self.source, self.subscription = name, None
        if settings.subscribe_rgbd:
            image, _ = image_topics(settings)
            self.source = f'{name.replace("/", "_")} of {image}'
        else:
            self.subscription = camera_info_subscription(node, name, self.take)
        self._image = node.resolve_topic_name(image)
        # rgbd_image is defined to have rectified images
        self._rectified = settings.image_rectification == 'rectified' or (
            settings.image_rectification == 'auto'
            and (settings.subscribe_rgbd or is_rectified(self._image)))

    def take(self, message: CameraInfo) -> None:
        """Take a message."""
        try:
            camera = to_camera(message, self._rectified)
        except InputError as error:
            self._rejection = str(error)
            self._logger.warning(f'camera_info on {self.place} rejected: {error}',
                                 throttle_duration_sec=_THROTTLE)
            return
        if self.subscription is not None:
            self.subscription.may_be_silent = True  # some drivers send it once
        if camera != self.camera:
            self._report(camera)
            self.camera = camera
            self._on_change()

    def _report(self, camera: Camera) -> None:
        now = time.monotonic()
        is_rare = len(self._changes) < _MOST_CHANGES or now - self._changes[0] > _THROTTLE
        self._changes.append(now)
        if is_rare:
            self._logger.info(f'camera of {self._image}, '
                              f'{"rectified" if self._rectified else "raw"} images: {camera}')
        else:
            self._logger.warning(
                f'camera_info on {self.place} changes again and again: if two drivers publish '
                'it, remap one of them to another topic', throttle_duration_sec=_THROTTLE)

    @property
    def remedy(self) -> str:
        """Why the last camera_info was rejected; where none came, what to remap."""
        if self._rejection:
            return self._rejection
        return ('its calibrations are empty' if self.subscription is None
                else f'remap {self.source} to the topic of the calibration')

    @property
    def place(self) -> str:
        """Name of the topic, resolved, or of the part of rgbd_image."""
        return self.source if self.subscription is None else self.subscription.topic_name
