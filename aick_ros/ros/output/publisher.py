# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages and TF of the base's odometry, as their consumers expect them."""

from __future__ import annotations

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import (
    BaseMotion, BaseOdometry, BaseState, BaseUpdate, Mount)
from aick_ros.ros import conversions
from aick_ros.ros.input.guess import Guess
from aick_ros.ros.input.transforms import TransformBroadcaster
from aick_ros.settings.node import NodeSettings

_QUEUE = 10


class OdometryPublisher:
    """
    Publishes ``odom``, ``pose`` and TF in the frame of the robot's base.

    While the camera is lost ``lost_policy`` counts and TF stops; the first message after a loss
    has a covariance of 9999. With a guess, the pose goes on with it while the camera is lost, and
    TF is that of the guess's frame, which has the base as a child already.

    :param guess: where the base is in ``guess_frame_id``; None: there is none.
    :raises InputError: where ``initial_pose`` is none.
    """

    def __init__(self, node: Node, settings: NodeSettings, guess: Guess | None = None) -> None:
        self._settings = settings
        self._guess = guess
        self._odom_frame, self._base_frame = settings.odom_frame_id, settings.frame_id
        self._base = BaseOdometry(PoseWithCovariance(_initial_pose(settings)))
        self._odom = node.create_publisher(Odometry, 'odom', _QUEUE)
        self._pose = node.create_publisher(PoseWithCovarianceStamped, 'pose', _QUEUE)
        self._tf = TransformBroadcaster(node) if settings.publish_tf else None

    @property
    def T_odom_base(self) -> np.ndarray:
        """Pose of the base, the last one measured, predicted or set, 4x4."""
        return self._base.pose.matrix

    def reset(self) -> None:
        """Begin at the origin again, with a camera whose odometry has been reset."""
        self._base.reset()

    def set_pose(self, T_odom_base: np.ndarray, covariance: np.ndarray,
                 is_blind: bool = False) -> None:
        """
        Go on from a pose and its 6x6 covariance.

        :param is_blind: whether frames are not used at present, as while paused.
        """
        self._base.set_pose(PoseWithCovariance(T_odom_base, covariance), is_blind)

    def publish(self, update: OdometryUpdate, T_base_camera: np.ndarray,
                mount: Mount = Mount.FIXED) -> bool:
        """
        Publish an update; return whether a message was sent.

        :param T_base_camera: the extrinsic, 4x4.
        :param mount: how the camera sits on the base.
        """
        base = self._base.update(update, T_base_camera, mount)
        if base is None:
            return False  # consumers take stamps that repeat or go back for a restart
        if base.state is not BaseState.LOST:
            self._send_tf(base)
        if base.state in (BaseState.LOST, BaseState.PREDICTED):
            return self._publish_lost(base)
        covariance = (conversions.UNKNOWN if base.state is BaseState.RECOVERED
                      else _below_unknown(base.pose.covariance))
        self._send(conversions.pose_with_covariance(
            base.stamp, self._odom_frame, base.pose.matrix, covariance), base.motion)
        return True

    def _send_tf(self, base: BaseUpdate) -> None:
        if self._tf is None:
            return
        T_odom_base = base.pose.matrix
        if self._guess is None:
            self._tf.send(base.stamp, self._odom_frame, self._base_frame, T_odom_base)
            return
        T_guess_base = self._guess.T_guess_base(base.stamp)
        if T_guess_base is not None:
            self._tf.send(base.stamp, self._odom_frame, self._settings.guess_frame_id,
                          T_odom_base @ se3.inverse(T_guess_base))

    def _publish_lost(self, base: BaseUpdate) -> bool:
        if self._settings.lost_policy == 'silent':
            return False
        if self._settings.lost_policy == 'null':
            self._send(conversions.null_pose(base.stamp, self._odom_frame), None)
        else:
            self._send(conversions.pose_with_covariance(
                base.stamp, self._odom_frame, base.pose.matrix, conversions.UNKNOWN), None)
        return True

    def _send(self, pose: PoseWithCovarianceStamped, motion: BaseMotion | None) -> None:
        self._pose.publish(pose)
        if motion is None:
            twist, covariance = np.zeros(6), conversions.UNKNOWN
        else:
            twist, covariance = motion.twist, _below_unknown(
                motion.twist_covariance if self._settings.twist_covariance == 'velocity'
                else motion.covariance)
        self._odom.publish(conversions.odometry(pose, self._base_frame, twist, covariance))


def _initial_pose(settings: NodeSettings) -> np.ndarray:
    numbers = settings.initial_pose
    if not numbers:
        return np.eye(4)
    if len(numbers) != 6 or not np.isfinite(numbers).all():
        raise InputError(f'initial_pose = {list(numbers)} is no pose: it takes x y z [m] roll '
                         'pitch yaw [rad]')
    x, y, z, roll, pitch, yaw = numbers
    return se3.from_roll_pitch_yaw(roll, pitch, yaw, (x, y, z))


def _below_unknown(covariance: np.ndarray) -> np.ndarray:
    """Scale a covariance down where it would be taken for that of a lost camera."""
    largest = float(np.diag(covariance).max())
    return covariance * min(1.0, 0.99 * conversions.UNKNOWN[0, 0] / max(largest, 1e-12))
