# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""TF: the robot's transforms in, the odometry's out."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from aick_ros.errors import InputError
from aick_ros.geometry.frame_tree import FrameTree
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.ros.conversions import from_transform, to_stamp, transform_stamped

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # the pip wheels of ROS have none
    TFMessage = None

_QUEUE = 100
_MOST_UNSETTLED = 16  # pairs of frames; images of ever new frames must not fill the memory
_OLDEST = NANOSECONDS // 2  # by which a moving link may be older or newer than an image


class Transforms:
    """
    The transforms of the robot as its other nodes tell them, at the stamps of images.

    What only fixed links tell is looked up once. /tf, which may be busy, is listened to only as
    long as something is asked for that the fixed links do not tell.

    :param own: (parent, child) of the link that this node itself publishes; it tells nothing.
    :param on_change: called when a transform has come.
    """

    def __init__(self, node: Node, own: tuple[str, str], on_change: Callable[[], None]) -> None:
        self._node = node
        self._own = _plain(own[0]), _plain(own[1])
        self._on_change = on_change
        self._tree = FrameTree()
        self._known: dict[tuple[str, str], np.ndarray] = {}
        self._changed = threading.Condition()
        self._unsettled: set[tuple[str, str]] = set()
        self._listener: Subscription | None = None
        if TFMessage is not None:
            node.create_subscription(
                TFMessage, '/tf_static', self._take_fixed,
                QoSProfile(depth=_QUEUE, durability=DurabilityPolicy.TRANSIENT_LOCAL))

    def find(self, target: str, source: str, stamp: int, wait: float = 0.0) -> np.ndarray | None:
        """
        Return ``T_target_source`` at a stamp, 4x4; None where nothing connects the two yet.

        :param stamp: [ns].
        :param wait: how long to wait until something connects them, and moving links are told up
            to the stamp [s]. Never wait on the executor's thread: nothing would come.
        :raises InputError: where a moving link is known only for other times.
        """
        target, source = _plain(target), _plain(source)
        with self._changed:
            if (target, source) in self._known:
                return self._known[target, source]
            self._changed.wait_for(lambda: self._is_told(target, source, stamp), wait)
            found = self._tree.find(target, source, stamp)
            if found is not None and found.is_static:
                self._known[target, source] = found.T_target_source
                self._unsettled.discard((target, source))
            elif len(self._unsettled) < _MOST_UNSETTLED:
                self._unsettled.add((target, source))
        if found is None:
            return None
        if found.gap > _OLDEST:
            raise InputError(
                f'the transform from {source!r} to {target!r} moves, and is known only '
                f'{found.gap / NANOSECONDS:.1f} s off the image: check that the clocks agree and '
                'that /tf goes on')
        return found.T_target_source

    def is_fixed(self, target: str, source: str) -> bool:
        """Return whether the transform between two frames was found of fixed links only."""
        with self._changed:
            return (_plain(target), _plain(source)) in self._known

    def tend(self) -> None:
        """Listen to /tf, or no longer; to be called now and then on the executor's thread."""
        wanted = bool(self._unsettled)
        if wanted and self._listener is None and TFMessage is not None:
            self._listener = self._node.create_subscription(
                TFMessage, '/tf', self._take_moving, QoSProfile(depth=_QUEUE))
        elif not wanted and self._listener is not None:
            self._node.destroy_subscription(self._listener)
            self._listener = None
            with self._changed:
                self._tree.clear_dynamic()

    def _is_told(self, target: str, source: str, stamp: int) -> bool:
        found = self._tree.find(target, source, stamp)
        return found is not None and found.gap == 0

    def _take_fixed(self, message: 'TFMessage') -> None:
        with self._changed:
            for link, T_parent_child in _links(message):
                self._tree.set_static(_plain(link.header.frame_id), _plain(link.child_frame_id),
                                      T_parent_child)
            self._known.clear()
            self._changed.notify_all()
        self._on_change()

    def _take_moving(self, message: 'TFMessage') -> None:
        with self._changed:
            for link, T_parent_child in _links(message):
                parent, child = _plain(link.header.frame_id), _plain(link.child_frame_id)
                if (parent, child) != self._own:
                    self._tree.add_sample(
                        parent, child, to_stamp(link.header.stamp), T_parent_child)
            self._changed.notify_all()
        self._on_change()


def _plain(frame: str) -> str:
    """Return a frame's name without the slash that old drivers set in front."""
    return frame.lstrip('/')


def _links(message: 'TFMessage') -> Iterator[tuple[TransformStamped, np.ndarray]]:
    for link in message.transforms:
        try:
            yield link, from_transform(link.transform)
        except ValueError:
            continue  # no transform: a null quaternion, or what is not finite


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
