# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Stamps and poses to ROS messages and back."""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import (
    Point, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion, Transform,
    TransformStamped, Twist, TwistWithCovariance, Vector3)
from nav_msgs.msg import Odometry
from std_msgs.msg import Header

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS

UNKNOWN = np.diag(np.full(6, 9999.0))
"""Covariance that RTAB-Map and robot_localization take for no measurement; by definition."""

_LEAST_VARIANCE = 1e-9  # chosen: consumers take zero for not set


def to_stamp(time: Time) -> int:
    """Return the stamp [ns] of a message."""
    return int(time.sec) * NANOSECONDS + int(time.nanosec)


def to_time(stamp: int) -> Time:
    """Return the message of a stamp [ns]."""
    return Time(sec=stamp // NANOSECONDS, nanosec=stamp % NANOSECONDS)


def header(stamp: int, frame_id: str) -> Header:
    """Return the header of a message."""
    return Header(stamp=to_time(stamp), frame_id=frame_id)


def quaternion(rotation: np.ndarray) -> Quaternion:
    """Return the message of a rotation, 3x3."""
    x, y, z, w = se3.to_quaternion(rotation).tolist()
    return Quaternion(x=x, y=y, z=z, w=w)


def pose(T: np.ndarray) -> Pose:
    """Return the message of a pose, 4x4."""
    x, y, z = T[:3, 3].tolist()
    return Pose(position=Point(x=x, y=y, z=z), orientation=quaternion(T[:3, :3]))


def pose_with_covariance(stamp: int, frame_id: str, T: np.ndarray,
                         covariance: np.ndarray) -> PoseWithCovarianceStamped:
    """Return a pose in ``frame_id`` with its 6x6 covariance."""
    return PoseWithCovarianceStamped(header=header(stamp, frame_id), pose=PoseWithCovariance(
        pose=pose(T), covariance=_row_major(covariance)))


def null_pose(stamp: int, frame_id: str) -> PoseWithCovarianceStamped:
    """Return what RTAB-Map takes for a lost camera: a zero quaternion, covariance 9999."""
    message = pose_with_covariance(stamp, frame_id, np.eye(4), UNKNOWN)
    message.pose.pose.orientation.w = 0.0
    return message


def odometry(pose: PoseWithCovarianceStamped, child_frame_id: str, twist: np.ndarray,
             twist_covariance: np.ndarray) -> Odometry:
    """
    Return a pose and a velocity as odometry.

    :param twist: (vx, vy, vz, wx, wy, wz) in the child frame [m/s, rad/s].
    :param twist_covariance: 6x6 in the child frame.
    """
    vx, vy, vz, wx, wy, wz = np.asarray(twist, np.float64).tolist()
    return Odometry(
        header=pose.header, child_frame_id=child_frame_id, pose=pose.pose,
        twist=TwistWithCovariance(
            twist=Twist(linear=Vector3(x=vx, y=vy, z=vz), angular=Vector3(x=wx, y=wy, z=wz)),
            covariance=_row_major(twist_covariance)))


def transform_stamped(stamp: int, frame_id: str, child_frame_id: str,
                      T: np.ndarray) -> TransformStamped:
    """Return ``T_frame_child`` as a message."""
    x, y, z = T[:3, 3].tolist()
    return TransformStamped(
        header=header(stamp, frame_id), child_frame_id=child_frame_id,
        transform=Transform(translation=Vector3(x=x, y=y, z=z),
                            rotation=quaternion(T[:3, :3])))


def from_pose(message: Pose) -> np.ndarray:
    """
    Return the pose of a message, 4x4.

    :raises ValueError: where it is not valid.
    """
    p, q = message.position, message.orientation
    return se3.from_quaternion((q.x, q.y, q.z, q.w), (p.x, p.y, p.z))


def from_transform(message: Transform) -> np.ndarray:
    """
    Return the pose of a transform, 4x4.

    :raises ValueError: where it is not valid.
    """
    t, q = message.translation, message.rotation
    return se3.from_quaternion((q.x, q.y, q.z, q.w), (t.x, t.y, t.z))


def _row_major(covariance: np.ndarray) -> np.ndarray:
    """
    Return the 36 numbers of a covariance, changed where consumers would misread them.

    RTAB-Map takes 1.0 and 0 at the first place for not set; numbers that are not finite are
    rejected everywhere.
    """
    if not np.isfinite(covariance).all():
        return UNKNOWN.ravel()
    sent = np.array(covariance)
    sent[np.diag_indices(6)] = np.maximum(np.diag(sent), _LEAST_VARIANCE)
    if sent[0, 0] == 1.0:
        sent[0, 0] = np.nextafter(1.0, 2.0)
    return sent.ravel()
