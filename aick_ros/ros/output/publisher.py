# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages and TF of the odometry of the base, as their consumers expect them."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

from aick_ros.geometry import se3
from aick_ros.odometry.base_odometry import BaseMotion, BaseState, BaseUpdate
from aick_ros.ros import conversions
from aick_ros.ros.input.guess import Guess
from aick_ros.ros.output.transform_broadcaster import TransformBroadcaster
from aick_ros.settings.node import NodeSettings

_QUEUE = 10
_LARGEST_VARIANCE = 0.99 * conversions.UNKNOWN[0, 0]  # derived: just below that of a lost camera


class OdometryPublisher:
    """
    Publishes ``odom``, ``pose`` and TF in the frame of the robot's base.

    While the camera is lost ``lost_policy`` decides what is sent; the first message after a loss
    has a covariance of 9999. TF stops, unless another sensor predicts the pose: then it continues.
    With a guess TF is that of ``guess_frame_id``, as the base is a child of that frame already;
    where the guess is not known it is the last one, so that a gap of the guess is none of ours.

    :param guess: pose of the base in ``guess_frame_id``; None: there is none.
    """

    def __init__(self, node: Node, settings: NodeSettings, guess: Guess | None = None) -> None:
        self._settings = settings
        self._guess = guess
        self._T_odom_guess: np.ndarray | None = None  # the last one known
        self._odom_frame, self._base_frame = settings.odom_frame_id, settings.frame_id
        self._odom = node.create_publisher(Odometry, 'odom', _QUEUE)
        self._pose = node.create_publisher(PoseWithCovarianceStamped, 'pose', _QUEUE)
        publishes_tf = settings.publish_tf
        if publishes_tf and settings.guess_frame_id == settings.odom_frame_id:
            publishes_tf = False
            node.get_logger().warning(
                'guess_frame_id is odom_frame_id, of which another node publishes TF: this one '
                'does not (set publish_tf to false to silence this)')
        self._tf = TransformBroadcaster(node) if publishes_tf else None

    def reset(self) -> None:
        """Forget TF of the guess: the base has been placed anew in ``odom_frame_id``."""
        self._T_odom_guess = None

    def publish(self, base: BaseUpdate) -> None:
        """Publish pose, motion and TF of the base at one frame."""
        if base.state is not BaseState.LOST:
            self._send_tf(base)
        if base.state in (BaseState.LOST, BaseState.PREDICTED):
            self._send_lost(base)
            return
        covariance = (conversions.UNKNOWN if base.state is BaseState.RECOVERED
                      else _below_unknown(base.pose.covariance))
        self._send(conversions.pose_with_covariance(
            base.stamp, self._odom_frame, base.pose.matrix, covariance), base.motion)

    def _send_tf(self, base: BaseUpdate) -> None:
        if self._tf is None:
            return
        T_odom_base = base.pose.matrix
        if self._guess is None:
            self._tf.send(base.stamp, self._odom_frame, self._base_frame, T_odom_base)
            return
        T_guess_base = self._guess.T_guess_base(base.stamp)
        if T_guess_base is not None:
            self._T_odom_guess = T_odom_base @ se3.inverse(T_guess_base)
        if self._T_odom_guess is not None:
            self._tf.send(base.stamp, self._odom_frame, self._settings.guess_frame_id,
                          self._T_odom_guess)

    def _send_lost(self, base: BaseUpdate) -> None:
        if self._settings.lost_policy == 'null':
            self._send(conversions.null_pose(base.stamp, self._odom_frame), None)
        elif self._settings.lost_policy == 'hold':
            self._send(conversions.pose_with_covariance(
                base.stamp, self._odom_frame, base.pose.matrix, conversions.UNKNOWN), None)

    def _send(self, pose: PoseWithCovarianceStamped, motion: BaseMotion | None) -> None:
        self._pose.publish(pose)
        if motion is None:
            twist, covariance = np.zeros(6), conversions.UNKNOWN
        else:
            twist, covariance = motion.twist, _below_unknown(
                motion.twist_covariance if self._settings.twist_covariance == 'velocity'
                else motion.covariance)
        self._odom.publish(conversions.odometry(pose, self._base_frame, twist, covariance))


def _below_unknown(covariance: np.ndarray) -> np.ndarray:
    """
    Return a covariance without a variance that would be taken for that of a lost camera.

    Each axis is scaled by itself, so that what is not known about one leaves the others as they
    are, and their correlations.
    """
    scale = np.sqrt(_LARGEST_VARIANCE / np.maximum(np.diag(covariance), _LARGEST_VARIANCE))
    scaled: np.ndarray = covariance * np.outer(scale, scale)
    return scaled
