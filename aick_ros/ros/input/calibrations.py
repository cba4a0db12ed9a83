# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The cameras as their camera_info topics describe them."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node
from sensor_msgs.msg import CameraInfo

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.messages.camera_info import is_rectified, to_camera
from aick_ros.settings.node import NodeSettings

_THROTTLE = 5.0  # seconds between two log lines of the same kind


class Calibration:
    """
    The latest usable camera_info of a topic.

    :param name: of the topic in the node's contract.
    :param image: name of the topic whose images it describes.
    :param on_change: called when another camera is described than before.
    """

    def __init__(self, node: Node, name: str, image: str, settings: NodeSettings,
                 on_change: Callable[[], None]) -> None:
        self._logger, self._on_change = node.get_logger(), on_change
        self._topic, self._image = node.resolve_topic_name(name), node.resolve_topic_name(image)
        self._rectified = settings.image_rectification == 'rectified' or (
            settings.image_rectification == 'auto'
            and is_rectified(self._image))
        self.camera: Camera | None = None

    def take(self, message: CameraInfo) -> bool:
        """Take a message, or log why it is refused; return whether it could be used."""
        try:
            camera = to_camera(message, self._rectified)
        except InputError as error:
            self._logger.warning(f'camera_info on {self._topic} refused: {error}',
                                 throttle_duration_sec=_THROTTLE)
            return False
        if camera != self.camera:
            self.camera = camera
            self._logger.info(f'camera of {self._image}, '
                              f'{"rectified" if self._rectified else "raw"} images: {camera}')
            self._on_change()
        return True
