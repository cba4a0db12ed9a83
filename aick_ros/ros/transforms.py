# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""TF: the camera's extrinsic in, the odometry's transform out."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from aick_ros import rigid
from aick_ros.errors import InputError
from aick_ros.ros.messages import from_transform, transform_stamped

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # the pip wheels of ROS have none
    TFMessage = None

_QUEUE = 100


class StaticTransforms:
    """
    The fixed transforms of /tf_static, each looked up once.

    :param T_base_camera: the extrinsic where a parameter gives it; TF is not asked then.
    :param on_change: called when a transform has come.
    """

    def __init__(self, node: Node, base_frame: str, T_base_camera: np.ndarray | None,
                 on_change: Callable[[], None]) -> None:
        self._base_frame = base_frame.lstrip('/')
        self._given = T_base_camera
        self._on_change = on_change
        self._lock = threading.Lock()
        self._parents: dict[str, tuple[str, np.ndarray]] = {}
        if TFMessage is not None and T_base_camera is None:
            node.create_subscription(
                TFMessage, '/tf_static', self._take,
                QoSProfile(depth=_QUEUE, durability=DurabilityPolicy.TRANSIENT_LOCAL))

    def camera_in_base(self, camera_frame: str) -> np.ndarray:
        """
        Return ``T_base_camera``, never a guess.

        :raises InputError: naming both frames where nothing connects them yet.
        """
        if self._given is not None:
            return self._given
        camera_frame = camera_frame.lstrip('/')
        if camera_frame == self._base_frame:
            return np.eye(4)
        with self._lock:
            base, camera = self._chain(self._base_frame), self._chain(camera_frame)
        for frame, T_frame_base in base.items():
            if frame in camera:
                return rigid.inverse(T_frame_base) @ camera[frame]
        remedy = ('publish the static transform between them' if TFMessage is not None else
                  'tf2_msgs is not installed, so TF cannot be asked')
        raise InputError(
            f'no transform from {camera_frame!r} (the colour image) to {self._base_frame!r} '
            f'(frame_id) yet: {remedy}, or set camera_in_base, or set frame_id to '
            f'{camera_frame!r}')

    def _take(self, message: 'TFMessage') -> None:
        with self._lock:
            for link in message.transforms:
                try:
                    T_parent_child = from_transform(link.transform)
                except ValueError:
                    continue
                parent = link.header.frame_id.lstrip('/')
                self._parents[link.child_frame_id.lstrip('/')] = (parent, T_parent_child)
        self._on_change()

    def _chain(self, frame: str) -> dict[str, np.ndarray]:
        """Return ``T_ancestor_frame`` of the frame and all its ancestors, nearest first."""
        chain = {}
        T_ancestor_frame = np.eye(4)
        while frame not in chain:  # a loop of frames ends where it began
            chain[frame] = T_ancestor_frame
            frame, T_parent_child = self._parents.get(frame, (frame, np.eye(4)))
            T_ancestor_frame = T_parent_child @ T_ancestor_frame
        return chain


class TransformBroadcaster:
    """Publishes the odometry's transform on /tf; does nothing where tf2_msgs is missing."""

    def __init__(self, node: Node) -> None:
        self._publisher = None
        if TFMessage is None:
            node.get_logger().warning(
                'tf2_msgs is not installed: no TF is published (set publish_tf to false to '
                'silence this)')
        else:
            self._publisher = node.create_publisher(TFMessage, '/tf', QoSProfile(depth=_QUEUE))

    def send(self, stamp: int, frame_id: str, child_frame_id: str, T: np.ndarray) -> None:
        """Publish ``T_frame_child`` at a stamp [ns]."""
        if self._publisher is not None:
            link: TransformStamped = transform_stamped(stamp, frame_id, child_frame_id, T)
            self._publisher.publish(TFMessage(transforms=[link]))
