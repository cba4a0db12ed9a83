# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""All topics on which a frame is published."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from rclpy.node import Node

from aick_ros.ros.input.guess import Guess
from aick_ros.ros.output.publisher import OdometryPublisher
from aick_ros.ros.output.rtabmap import RtabmapTopics
from aick_ros.ros.output.views import Views
from aick_ros.ros.robot_odometry import RobotUpdate
from aick_ros.settings import NodeSettings


class Outputs:
    """
    Publishes the odometry, then what RTAB-Map and people want to see.

    :param guess: pose of the base in ``guess_frame_id``; None: there is none.
    :param local_map: returns the keypoints of the keyframes in the camera's frame, Nx3 [m].
    """

    def __init__(self, node: Node, settings: NodeSettings, guess: Guess | None,
                 local_map: Callable[[], np.ndarray]) -> None:
        self._publisher = OdometryPublisher(node, settings, guess)
        self._views = Views(node, settings.odom_frame_id)
        self._rtabmap = RtabmapTopics(node, settings.odom_frame_id, local_map)

    def publish(self, update: RobotUpdate) -> None:
        """Publish what other nodes wait for."""
        if update.base is not None:
            self._publisher.publish(update.base)
            self._rtabmap.show(update, update.base)

    def show(self, update: RobotUpdate) -> None:
        """Publish what is for display."""
        self._views.show(update.frame, update.camera, update.T_odom_base, update.T_base_camera,
                         update.camera_frame)

    def place_anew(self) -> None:
        """Forget TF of the guess: the base has been placed anew in ``odom_frame_id``."""
        self._publisher.reset()

    def reset(self) -> None:
        """Begin anew, as the odometry does."""
        self.place_anew()
        self._views.reset()
        self._rtabmap.reset()
