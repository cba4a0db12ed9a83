# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Path, keypoints and matches for display, made only while somebody subscribes."""

from __future__ import annotations

import time
from array import array

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.node import Node
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Header

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.odometry import OdometryUpdate
from aick_ros.ros import conversions
from aick_ros.ros.output.debug_image import draw_matches

POINT_STEP = 12
"""Bytes of a point; derived: three float32."""

_LONGEST_PATH = 1000  # poses; chosen
_SHORT_PATH = 100  # poses; chosen: shorter paths are published with each frame
_INTERVAL = 5e-4  # s per pose between longer paths; chosen: a hundred times what they take
_QUEUE = 1  # only the newest is displayed


class Views:
    """Publishes ``path``, ``keypoints`` and ``debug_image``."""

    def __init__(self, node: Node, odom_frame: str) -> None:
        self._odom_frame = odom_frame
        self._poses: list[PoseStamped] = []
        self._path_due = 0.0  # steady time [s]
        self._path = node.create_publisher(Path, 'path', _QUEUE)
        self._keypoints = node.create_publisher(PointCloud2, 'keypoints', _QUEUE)
        self._debug_image = node.create_publisher(Image, 'debug_image', _QUEUE)

    def reset(self) -> None:
        """Restart the path."""
        self._poses.clear()

    def show(self, frame: RgbdFrame, update: OdometryUpdate, T_odom_base: np.ndarray,
             T_base_camera: np.ndarray, camera_frame: str) -> None:
        """
        Publish what has a subscriber.

        :param T_odom_base: published pose, 4x4.
        :param T_base_camera: extrinsic, 4x4.
        :param camera_frame: frame of the images.
        """
        header = conversions.header(update.stamp, self._odom_frame)
        if update.status.ok:
            self._lengthen(PoseStamped(header=header, pose=conversions.pose(T_odom_base)))
            now = time.monotonic()
            if self._path.get_subscription_count() and (
                    now >= self._path_due or len(self._poses) <= _SHORT_PATH):
                self._path.publish(Path(header=header, poses=self._poses))
                self._path_due = now + _INTERVAL * len(self._poses)
            if self._keypoints.get_subscription_count():
                self._keypoints.publish(point_cloud(header, se3.transform(
                    T_odom_base @ T_base_camera, update.keypoints.positions)))
        if self._debug_image.get_subscription_count():
            self._debug_image.publish(colour_image(
                conversions.header(update.stamp, camera_frame),
                draw_matches(frame.colour, update)))

    def _lengthen(self, pose: PoseStamped) -> None:
        """Append a pose; a path that is too long loses every second one, but not its start."""
        if len(self._poses) >= _LONGEST_PATH:
            del self._poses[1::2]
        self._poses.append(pose)


def point_cloud(header: Header, positions: np.ndarray) -> PointCloud2:
    """Return the message of points, Nx3 [m]."""
    return PointCloud2(
        header=header, height=1, width=len(positions),
        fields=[PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
                for i, name in enumerate('xyz')],
        is_bigendian=False, point_step=POINT_STEP, row_step=POINT_STEP * len(positions),
        is_dense=True,
        data=array('B', positions.astype('<f4').tobytes()))


def positions_of(message: PointCloud2) -> np.ndarray:
    """Return the points of a message of :func:`point_cloud`, Nx3 [m]."""
    points: np.ndarray = np.frombuffer(bytes(message.data), '<f4')
    return points.reshape(-1, 3)


def colour_image(header: Header, colour: np.ndarray) -> Image:
    """Return the message of an image, HxWx3 uint8 (red, green, blue)."""
    height, width, _ = colour.shape
    return Image(header=header, height=height, width=width, encoding='rgb8', step=3 * width,
                 data=array('B', colour.tobytes()))
