# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Requests to the node: services, and a pose to continue from."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.logging import LoggingSeverity
from rclpy.node import Node
from std_srvs.srv import Empty

from aick_ros.borders.limits import MAX_DISTANCE
from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.ros.conversions import from_pose
from aick_ros.ros.rtabmap_messages import ResetPose

_QUEUE = 10
_THROTTLE = 1.0  # seconds between two log lines of the same kind; chosen
_LARGEST_COVARIANCE = MAX_DISTANCE ** 2  # of a pose [m^2]; derived
_LEVELS = {'debug': LoggingSeverity.DEBUG, 'info': LoggingSeverity.INFO,
           'warning': LoggingSeverity.WARN, 'error': LoggingSeverity.ERROR}


class Control:
    """
    The services ``~/reset_odom``, ``~/pause_odom`` and others, and the topic ``set_pose``.

    :param odom_frame: the only frame in which a pose can be set.
    :param on_reset: called to restart the odometry at ``T_odom_base``; None: at the origin or at
        the guess.
    :param on_pause: called when frames are skipped from now on.
    :param on_pose: called with ``T_odom_base``, and whether the node is paused.
    """

    def __init__(self, node: Node, odom_frame: str,
                 on_reset: Callable[[PoseWithCovariance | None], None],
                 on_pause: Callable[[], None],
                 on_pose: Callable[[PoseWithCovariance, bool], None]) -> None:
        self._logger = node.get_logger()
        self._odom_frame = odom_frame
        self._on_reset, self._on_pause, self._on_pose = on_reset, on_pause, on_pose
        self._paused = False
        node.create_service(Empty, '~/reset_odom', self._reset)
        if ResetPose is not None:
            node.create_service(ResetPose, '~/reset_odom_to_pose', self._reset_to_pose)
        node.create_service(Empty, '~/pause_odom', self._pause)
        node.create_service(Empty, '~/resume_odom', self._resume)
        for name, level in _LEVELS.items():
            node.create_service(Empty, f'~/log_{name}', partial(self._set_level, level))
        node.create_subscription(PoseWithCovarianceStamped, 'set_pose', self._set_pose, _QUEUE)

    @property
    def paused(self) -> bool:
        """State in which frames are skipped."""
        return self._paused

    def _reset(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        self._on_reset(None)
        return response

    def _reset_to_pose(self, request: ResetPose.Request,
                       response: ResetPose.Response) -> ResetPose.Response:
        try:
            self._on_reset(PoseWithCovariance(_requested_pose(request)))
        except InputError as error:
            self._logger.warning(f'reset_odom_to_pose rejected: {error}')
        return response

    def _pause(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        self._paused = True
        self._on_pause()
        self._logger.info('paused')
        return response

    def _resume(self, request: Empty.Request, response: Empty.Response) -> Empty.Response:
        self._paused = False
        self._logger.info('resumed')
        return response

    def _set_level(self, level: LoggingSeverity, request: Empty.Request,
                   response: Empty.Response) -> Empty.Response:
        self._logger.set_level(level)
        return response

    def _set_pose(self, message: PoseWithCovarianceStamped) -> None:
        try:
            self._on_pose(_pose_to_set(message, self._odom_frame), self._paused)
        except InputError as error:
            self._logger.warning(f'set_pose rejected: {error}',
                                 throttle_duration_sec=_THROTTLE)


def _requested_pose(request: ResetPose.Request) -> np.ndarray:
    """
    Return ``T_odom_base``, 4x4.

    :raises InputError: where its numbers are not finite or it is too far away.
    """
    angles = request.roll, request.pitch, request.yaw
    if not np.isfinite(angles).all():
        raise InputError('its angles are not finite')
    return se3.checked(se3.from_roll_pitch_yaw(*angles, (request.x, request.y, request.z)),
                       'what it asks for')


def _pose_to_set(message: PoseWithCovarianceStamped, odom_frame: str) -> PoseWithCovariance:
    """
    Return the pose of a message.

    :raises InputError: where it is not valid, or given in another frame.
    """
    frame = message.header.frame_id.lstrip('/')
    if frame not in ('', odom_frame):
        raise InputError(f'its frame is {quoted(frame)}: {quoted(odom_frame)} (odom_frame_id) is '
                         'required')
    try:
        T_odom_base = from_pose(message.pose.pose)
    except ValueError as error:
        raise InputError(f'{error}; all numbers must be finite, and the quaternion not zero'
                         ) from None
    covariance = np.reshape(message.pose.covariance, (6, 6))
    if not (np.abs(covariance) <= _LARGEST_COVARIANCE).all():  # comparisons with NaN are false
        raise InputError(f'its covariance is not finite, or more than {_LARGEST_COVARIANCE:g}')
    covariance = 0.5 * (covariance + covariance.T)
    least, *_, largest = np.linalg.eigvalsh(covariance)
    if least < -1e-9 * max(1.0, largest):
        raise InputError('its covariance is not positive semidefinite')
    return PoseWithCovariance(T_odom_base, covariance)
