# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images, cameras and poses as ROS 2 messages of rosbags."""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.messages.raw_image import ImageFields

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)
OPTICAL_FRAME = 'camera_rgb_optical_frame'
WORLD_FRAME = 'world'

_TYPES = TYPESTORE.types


def image(stamp: int, fields: ImageFields) -> Any:
    """Return a sensor_msgs/Image with a stamp [ns]."""
    return _TYPES['sensor_msgs/msg/Image'](
        _header(stamp, OPTICAL_FRAME), fields.height, fields.width, fields.encoding,
        fields.is_bigendian, fields.step, fields.data)


def camera_info(stamp: int, camera: Camera) -> Any:
    """Return a sensor_msgs/CameraInfo of raw images with a stamp [ns]."""
    projection = np.column_stack([camera.matrix, np.zeros(3)])
    region = _TYPES['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)
    return _TYPES['sensor_msgs/msg/CameraInfo'](
        _header(stamp, OPTICAL_FRAME), camera.height, camera.width, camera.distortion_model,
        np.array(camera.distortion, np.float64), camera.matrix.ravel(), np.eye(3).ravel(),
        projection.ravel(), 0, 0, region)


def imu(stamp: int, turn_rate: np.ndarray, acceleration: np.ndarray) -> Any:
    """Return a sensor_msgs/Imu with a stamp [ns]; what is NaN is marked as not measured."""
    covariance, vector = np.zeros(9), _TYPES['geometry_msgs/msg/Vector3']
    unknown = np.array([-1.0, *np.zeros(8)])
    values = (part for measured in (turn_rate, acceleration) for part in (
        vector(*map(float, np.nan_to_num(measured))),
        unknown if np.isnan(measured).any() else covariance))
    return _TYPES['sensor_msgs/msg/Imu'](
        _header(stamp, OPTICAL_FRAME), _TYPES['geometry_msgs/msg/Quaternion'](0.0, 0.0, 0.0, 1.0),
        unknown, *values)


def pose(stamp: int, T_world_camera: np.ndarray) -> Any:
    """Return a geometry_msgs/PoseStamped of ``T_world_camera``, 4x4, with a stamp [ns]."""
    position = map(float, T_world_camera[:3, 3])
    quaternion = map(float, se3.to_quaternion(T_world_camera[:3, :3]))
    return _TYPES['geometry_msgs/msg/PoseStamped'](
        _header(stamp, WORLD_FRAME),
        _TYPES['geometry_msgs/msg/Pose'](_TYPES['geometry_msgs/msg/Point'](*position),
                                         _TYPES['geometry_msgs/msg/Quaternion'](*quaternion)))


def _header(stamp: int, frame_id: str) -> Any:
    time = _TYPES['builtin_interfaces/msg/Time'](*divmod(stamp, NANOSECONDS))
    return _TYPES['std_msgs/msg/Header'](time, frame_id)
