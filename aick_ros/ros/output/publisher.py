# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the node publishes of an odometry update, as its consumers expect it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import BasePose, Mount
from aick_ros.registration.status import Status
from aick_ros.ros import conversions
from aick_ros.ros.input.guess import Guess
from aick_ros.ros.input.transforms import TransformBroadcaster
from aick_ros.settings.node import NodeSettings

_QUEUE = 10
_CERTAIN = np.zeros((6, 6))


class _Motion(NamedTuple):
    """A twist in the base frame and its 6x6 covariance; that of a lost camera by default."""

    twist: np.ndarray = np.zeros(6)
    covariance: np.ndarray = conversions.UNKNOWN


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
        self._base = BasePose(_initial_pose(settings), _CERTAIN)
        self._T_base_camera: np.ndarray | None = None
        self._is_lost = False
        self._odom = node.create_publisher(Odometry, 'odom', _QUEUE)
        self._pose = node.create_publisher(PoseWithCovarianceStamped, 'pose', _QUEUE)
        self._tf = TransformBroadcaster(node) if settings.publish_tf else None

    @property
    def T_odom_base(self) -> np.ndarray:
        """The last pose that was tracked, guessed or set, 4x4."""
        return self._base.T_odom_base

    def reset(self) -> None:
        """Begin at the origin again, with a camera whose odometry has been reset."""
        self._base = BasePose(np.eye(4), _CERTAIN)

    def set_pose(self, T_odom_base: np.ndarray, covariance: np.ndarray,
                 is_blind: bool = False) -> None:
        """
        Go on from a pose and its 6x6 covariance.

        The robot may have been carried there while the camera was lost: what it then finds to
        have moved since it was last tracked is not added.

        :param is_blind: whether the camera is not looked at either, as it is while paused.
        """
        self._base.put(T_odom_base, covariance)
        if is_blind or self._is_lost:
            self._base.restart()

    def publish(self, update: OdometryUpdate, T_base_camera: np.ndarray,
                mount: Mount = Mount.FIXED) -> bool:
        """
        Publish an update; return whether there was anything to say.

        :param T_base_camera: the extrinsic, 4x4.
        :param mount: how the camera sits on the base.
        """
        if update.status is Status.BAD_STAMP:
            return False  # consumers take stamps that repeat or go back for a restart
        T_base_camera0, self._T_base_camera = self._T_base_camera, T_base_camera
        self._is_lost = not (update.status.ok or update.predicted)
        if not self._is_lost:
            _, covariance = self._base.follow(
                update.T_odom_camera, update.pose.covariance, T_base_camera, mount)
            self._send_tf(update.stamp)
        if not update.status.ok:
            return self._publish_lost(update.stamp)
        if mount is Mount.FIXED or T_base_camera0 is None:
            T_base_camera0 = T_base_camera
        self._send(
            conversions.pose_with_covariance(
                update.stamp, self._odom_frame, self._base.T_odom_base,
                conversions.UNKNOWN if update.recovered else _below_unknown(covariance)),
            self._motion(update, T_base_camera0, T_base_camera))
        return True

    def _send_tf(self, stamp: int) -> None:
        if self._tf is None:
            return
        if self._guess is None:
            self._tf.send(stamp, self._odom_frame, self._base_frame, self._base.T_odom_base)
            return
        T_guess_base = self._guess.T_guess_base(stamp)
        if T_guess_base is not None:
            self._tf.send(stamp, self._odom_frame, self._settings.guess_frame_id,
                          self._base.T_odom_base @ se3.inverse(T_guess_base))

    def _publish_lost(self, stamp: int) -> bool:
        if self._settings.lost_policy == 'silent':
            return False
        if self._settings.lost_policy == 'null':
            self._send(conversions.null_pose(stamp, self._odom_frame), _Motion())
        else:
            self._send(conversions.pose_with_covariance(
                stamp, self._odom_frame, self._base.T_odom_base, conversions.UNKNOWN), _Motion())
        return True

    def _send(self, located: PoseWithCovarianceStamped, motion: _Motion) -> None:
        self._pose.publish(located)
        self._odom.publish(conversions.odometry(
            located, self._base_frame, motion.twist, motion.covariance))

    def _motion(self, update: OdometryUpdate, T_base_camera0: np.ndarray,
                T_base_camera: np.ndarray) -> _Motion:
        """
        Return the mean velocity of the base over the increment and its covariance.

        :param T_base_camera0: the extrinsic at the last frame; another one if the camera moves.
        """
        if update.increment is None or update.recovered:
            return _Motion()
        _, covariance = se3.change_body(
            update.increment.pose.matrix, update.increment.pose.covariance, T_base_camera)
        increment = T_base_camera0 @ update.increment.pose.matrix @ se3.inverse(T_base_camera)
        turn = np.kron(np.eye(2), increment[:3, :3].T)  # to the axes of the base as it is now
        covariance = turn @ covariance @ turn.T
        if self._settings.twist_covariance == 'velocity':
            covariance = covariance / update.increment.interval ** 2
        return _Motion(se3.log(increment) / update.increment.interval, _below_unknown(covariance))


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
