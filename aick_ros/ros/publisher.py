# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the node publishes of an odometry update, as its consumers expect it."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

from aick_ros import rigid
from aick_ros.odometry import OdometryUpdate
from aick_ros.ros import messages
from aick_ros.ros.transforms import TransformBroadcaster
from aick_ros.settings import NodeSettings
from aick_ros.status import Status

_QUEUE = 10


class OdometryPublisher:
    """
    Publishes ``odom``, ``pose`` and TF in the frame of the robot's base.

    Where the camera is lost the last pose is repeated with zero twist and a covariance of 9999,
    and TF stops; the first message after a loss still has that covariance.
    """

    def __init__(self, node: Node, settings: NodeSettings) -> None:
        self._odom_frame, self._base_frame = settings.odom_frame_id, settings.frame_id
        self._odom = node.create_publisher(Odometry, 'odom', _QUEUE)
        self._pose = node.create_publisher(PoseWithCovarianceStamped, 'pose', _QUEUE)
        self._tf = TransformBroadcaster(node) if settings.publish_tf else None
        self.reset()

    def reset(self) -> None:
        """Begin at the origin again."""
        self._T_odom_base = np.eye(4)

    def publish(self, update: OdometryUpdate, T_base_camera: np.ndarray) -> bool:
        """
        Publish an update; return whether there was anything to say.

        :param T_base_camera: the extrinsic, 4x4.
        """
        if update.status is Status.BAD_STAMP:
            return False  # consumers take stamps that repeat or go back for a restart
        covariance, twist, twist_covariance = messages.UNKNOWN, np.zeros(6), messages.UNKNOWN
        if update.status.ok:
            self._T_odom_base, pose_covariance = rigid.change_body(
                update.T_odom_camera, update.covariance, T_base_camera)
            if not update.recovered:
                covariance = _below_unknown(pose_covariance)
        if update.interval and not update.recovered:
            twist, twist_covariance = _velocity(update, T_base_camera)
        located = messages.pose_with_covariance(
            update.stamp, self._odom_frame, self._T_odom_base, covariance)
        if self._tf and update.status.ok:
            self._tf.send(update.stamp, self._odom_frame, self._base_frame, self._T_odom_base)
        self._pose.publish(located)
        self._odom.publish(messages.odometry(located, self._base_frame, twist, twist_covariance))
        return True


def _below_unknown(covariance: np.ndarray) -> np.ndarray:
    """Scale a covariance down where it would be taken for that of a lost camera."""
    largest = float(np.diag(covariance).max())
    return covariance * min(1.0, 0.99 * messages.UNKNOWN[0, 0] / max(largest, 1e-12))


def _velocity(update: OdometryUpdate, T_base_camera: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean velocity of the base over the increment and its covariance."""
    increment, covariance = rigid.change_body(
        update.increment, update.increment_covariance, T_base_camera)
    turn = np.kron(np.eye(2), increment[:3, :3].T)  # to the axes of the base as it is now
    return (rigid.log(increment) / update.interval,
            turn @ covariance @ turn.T / update.interval ** 2)
