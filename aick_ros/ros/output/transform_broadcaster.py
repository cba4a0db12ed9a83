# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The transform of the odometry on /tf."""

from __future__ import annotations

import numpy as np
from rclpy.node import Node
from rclpy.qos import QoSProfile

from aick_ros.ros.conversions import transform_stamped
from aick_ros.ros.tf_messages import TFMessage

_QUEUE = 100


class TransformBroadcaster:
    """Publishes transforms on /tf; does nothing, and says so once, without tf2_msgs."""

    def __init__(self, node: Node) -> None:
        self._publisher = None
        if TFMessage is None:
            node.get_logger().warning(
                'tf2_msgs is not installed: no TF is published (set publish_tf to false to '
                'silence this)')
        else:
            self._publisher = node.create_publisher(TFMessage, '/tf', QoSProfile(depth=_QUEUE))

    def send(self, stamp: int, frame_id: str, child_frame_id: str,
             T_frame_child: np.ndarray) -> None:
        """Publish a transform, 4x4, at a stamp [ns]."""
        if self._publisher is not None:
            self._publisher.publish(TFMessage(transforms=[
                transform_stamped(stamp, frame_id, child_frame_id, T_frame_child)]))
