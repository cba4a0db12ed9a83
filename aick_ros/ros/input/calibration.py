# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The calibration of a camera, as its camera_info topic describes it."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from sensor_msgs.msg import CameraInfo

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.messages.camera_info import is_rectified, to_camera
from aick_ros.ros.input.subscriptions import camera_info_subscription
from aick_ros.settings.node import NodeSettings

_THROTTLE = 5.0  # seconds between two log lines of the same kind; chosen


class Calibration:
    """
    The latest usable camera_info of a topic.

    :param name: unresolved name of the camera_info topic.
    :param image: unresolved name of the topic of the images that it describes.
    :param on_change: called when the camera is another one than before.
    :ivar camera: the camera; None until a usable message was received.
    """

    def __init__(self, node: Node, name: str, image: str, settings: NodeSettings,
                 on_change: Callable[[], None]) -> None:
        self._logger, self._on_change = node.get_logger(), on_change
        self._topic, self._image = node.resolve_topic_name(name), node.resolve_topic_name(image)
        self._rectified = settings.image_rectification == 'rectified' or (
            settings.image_rectification == 'auto' and is_rectified(self._image))
        self.camera: Camera | None = None
        self.subscription = camera_info_subscription(node, name, self._take)

    def _take(self, message: CameraInfo) -> None:
        try:
            camera = to_camera(message, self._rectified)
        except InputError as error:
            self._logger.warning(f'camera_info on {self._topic} rejected: {error}',
                                 throttle_duration_sec=_THROTTLE)
            return
        self.subscription.may_be_silent = True  # some drivers send it once
        if camera != self.camera:
            self.camera = camera
            self._logger.info(f'camera of {self._image}, '
                              f'{"rectified" if self._rectified else "raw"} images: {camera}')
            self._on_change()
