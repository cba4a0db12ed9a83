# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The transforms of the robot, from TF."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator

import numpy as np
from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription

from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.geometry.frame_tree import LARGEST_GAP, FrameTransform, FrameTree
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.ros.conversions import from_transform, to_stamp
from aick_ros.ros.input.lateness import Lateness
from aick_ros.ros.tf_messages import TFMessage

_QUEUE = 100
_THROTTLE = 5.0  # seconds between two log lines; chosen
_MOST_MOVING = 16  # pairs of frames; chosen: images of ever new frames must not fill the memory


class Transforms:
    """
    The transforms of the robot at the stamps of images.

    A transform of fixed links alone is looked up once. /tf, which may be busy, is subscribed to
    only while a transform is requested that the fixed links do not give.

    :param own: (parent, child) of the link that this node itself publishes; it is ignored.
    :param on_change: called when a transform was received.
    """

    def __init__(self, node: Node, own: tuple[str, str], on_change: Callable[[], None]) -> None:
        self._node = node
        self._own = _plain(own[0]), _plain(own[1])
        self._on_change = on_change
        self._tree = FrameTree()
        self._known: dict[tuple[str, str], FrameTransform] = {}
        self._changed = threading.Condition()
        self._waits = Counter[int]()  # by thread [ns]
        self._lateness = Lateness()
        self._moving: set[tuple[str, str]] = set()
        self._waited_in_vain = False  # for frames to be connected, since the last new link
        self._listener: Subscription | None = None
        if TFMessage is not None:
            node.create_subscription(
                TFMessage, '/tf_static', self._take_fixed,
                QoSProfile(depth=_QUEUE, durability=DurabilityPolicy.TRANSIENT_LOCAL))

    def find(self, target: str, source: str, stamp: int, wait: float = 0.0,
             largest_gap: int | None = None) -> FrameTransform | None:
        """
        Return the transform at a stamp; None where the two frames are not connected yet.

        :param stamp: [ns].
        :param wait: longest wait until they are connected and moving links reach the stamp [s].
            Frames that are not connected are waited for once, then not before there is a new link:
            images of unknown frames must not hold up the others. Never wait on the executor's
            thread: nothing would be received.
        :param largest_gap: time from the last sample of a moving link to the stamp [ns]; None: the
            link must have rested for as long before that sample, and for 0.5 s at most.
        :raises InputError: where a moving link is known only for other times.
        """
        target, source = _plain(target), _plain(source)
        with self._changed:
            if (target, source) in self._known:
                return self._known[target, source]
            found = self._awaited(target, source, stamp, wait)
            if found is None and wait > 0.0:
                self._waited_in_vain = True
            if found is not None and found.is_static:
                found.T_target_source.flags.writeable = False  # others get the same
                self._known[target, source] = found
                self._moving.discard((target, source))
            elif len(self._moving) < _MOST_MOVING:
                self._moving.add((target, source))
        if found is None:
            return None
        if not _counts(found, largest_gap):
            raise InputError(
                f'the transform from {quoted(source)} to {quoted(target)} moves, and the nearest '
                f'one is {found.gap / NANOSECONDS:.3f} s from the image stamp: check that the '
                'clocks agree and that /tf is still published, or raise wait_for_transform')
        return found

    def waited(self) -> float:
        """Return the time that the calling thread has waited for transforms [s]."""
        return self._waits[threading.get_ident()] / NANOSECONDS

    @property
    def waited_in_all(self) -> float:
        """Time that all threads have waited for transforms [s]."""
        with self._changed:
            return sum(self._waits.values()) / NANOSECONDS

    @property
    def complaint(self) -> str:
        """A sentence on each transform that arrives late, '' for none."""
        with self._changed:
            return self._lateness.complaint

    def tend(self) -> None:
        """Subscribe to /tf, or no longer; to be called regularly on the executor's thread."""
        wanted = bool(self._moving)
        if wanted and self._listener is None and TFMessage is not None:
            self._listener = self._node.create_subscription(
                TFMessage, '/tf', self._take_moving, QoSProfile(depth=_QUEUE))
        elif not wanted and self._listener is not None:
            self._node.destroy_subscription(self._listener)
            self._listener = None
            with self._changed:
                self._tree.clear_dynamic()

    def _awaited(self, target: str, source: str, stamp: int,
                 wait: float) -> FrameTransform | None:
        """Return a transform once it reaches the stamp, or as it is known after the wait [s]."""
        begun = time.monotonic_ns()
        may_come = self._may_come(self._tree.find(target, source, stamp), wait)
        if may_come:
            self._changed.wait_for(lambda: self._reaches(target, source, stamp), wait)
        found = self._tree.find(target, source, stamp)
        waited = time.monotonic_ns() - begun
        self._waits[threading.get_ident()] += waited
        if may_come and wait > 0.0 and found is not None and not found.is_past:
            self._lateness.note(target, source, (waited + found.gap) / NANOSECONDS)
        return found

    def _may_come(self, found: FrameTransform | None, wait: float) -> bool:
        """Return whether a wait [s] may bring a transform, as it is known before."""
        if found is None:
            return not self._waited_in_vain
        return not found.is_past and found.gap <= LARGEST_GAP + wait * NANOSECONDS

    def _reaches(self, target: str, source: str, stamp: int) -> bool:
        found = self._tree.find(target, source, stamp)
        return found is not None and found.gap == 0

    def _take_fixed(self, message: 'TFMessage') -> None:
        with self._changed:
            for link, T_parent_child in self._links(message):
                parent, child = _plain(link.header.frame_id), _plain(link.child_frame_id)
                self._note(parent, child)
                self._tree.set_static(parent, child, T_parent_child)
            self._known.clear()
            self._changed.notify_all()
        self._on_change()

    def _take_moving(self, message: 'TFMessage') -> None:
        with self._changed:
            for link, T_parent_child in self._links(message):
                parent, child = _plain(link.header.frame_id), _plain(link.child_frame_id)
                if (parent, child) != self._own:
                    self._note(parent, child)
                    self._tree.add_sample(
                        parent, child, to_stamp(link.header.stamp), T_parent_child)
            self._changed.notify_all()
        self._on_change()

    def _note(self, parent: str, child: str) -> None:
        if not self._tree.has_link(parent, child):
            self._waited_in_vain = False

    def _links(self, message: 'TFMessage') -> Iterator[tuple[TransformStamped, np.ndarray]]:
        for link in message.transforms:
            try:
                yield link, from_transform(link.transform)
            except ValueError as error:  # a null quaternion, not finite, or absurdly far
                names = f'{quoted(link.header.frame_id)} to {quoted(link.child_frame_id)}'
                self._node.get_logger().warning(
                    f'the transform from {names} is ignored: {error}; check its publisher',
                    throttle_duration_sec=_THROTTLE)


def _counts(found: FrameTransform, largest_gap: int | None) -> bool:
    """Return whether a transform is that of its stamp, up to a gap [ns]."""
    if largest_gap is None:
        return found.has_rested and found.gap <= LARGEST_GAP
    return not found.is_past and found.gap <= largest_gap


def _plain(frame: str) -> str:
    """Return the name of a frame without the leading slash of old drivers."""
    return frame.lstrip('/')
