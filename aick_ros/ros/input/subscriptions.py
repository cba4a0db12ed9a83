# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Subscriptions whose QoS matches that of the publishers."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from aick_ros.ros.conversions import to_stamp
from aick_ros.settings.node import NodeSettings

_CAMERA_INFO_QUEUE = 10
_OVERLAP = 0.2  # seconds for which both subscriptions receive; chosen


class AdaptiveSubscription:
    """
    Subscribes again when the publishers offer another QoS than was requested.

    The old subscription is destroyed some time after the new one received its first message, so
    that nothing is missed; an image that both receive is taken once.

    :param name: unresolved name of the topic.
    :param suffix: suffix of the topic after remapping, as image_transport names its transports.
    :param take: called with each message.
    :param reliability: ``auto`` requests reliable messages where every publisher offers them;
        ``reliable`` and ``best_effort`` do not change.
    :param latched: whether to request the last message that was published before.
    :ivar received_at: steady time of the last message, or of the construction [s].
    :ivar may_be_silent: whether no further message is required; set by whoever takes them.
    """

    def __init__(self, node: Node, kind: Any, name: str, take: Callable[[Any], None],
                 depth: int, reliability: str = 'auto', suffix: str = '',
                 latched: bool = False) -> None:
        self.name = name
        self._topic, self._suffix = node.resolve_topic_name(name) + suffix, suffix
        self._node, self._kind, self._take = node, kind, take
        self._reliability, self._latched, self._depth = reliability, latched, depth
        self._taken: deque[int] = deque(maxlen=2 * depth)
        self._overlap_since: float | None = None
        self._old: Subscription | None = None
        self.received_at = time.monotonic()
        self.may_be_silent = False
        # a message sent once must not be lost during discovery
        reliable = reliability == 'reliable' or latched
        self._new = self._subscribe(QoSProfile(
            depth=depth, reliability=ReliabilityPolicy.RELIABLE if reliable
            else ReliabilityPolicy.BEST_EFFORT))

    @property
    def topic_name(self) -> str:
        """Resolved name of the topic."""
        return str(self._new.topic_name)

    @property
    def qos_profile(self) -> QoSProfile:
        """Requested QoS."""
        return self._new.qos_profile

    def publishers(self) -> list[TopicEndpointInfo]:
        """Return the publishers of the topic."""
        return self._node.get_publishers_info_by_topic(self.topic_name)

    def published_instead(self) -> tuple[str, str]:
        """Return the topic and the name of another transport that is published; '' without one."""
        base = self._topic.removesuffix(self._suffix)
        for transport in ('raw', 'compressed', 'compressedDepth'):
            topic = base if transport == 'raw' else f'{base}/{transport}'
            if topic != self._topic and self._node.count_publishers(topic):
                return topic, transport
        return '', ''

    def adapt(self) -> None:
        """Match the QoS of the publishers; to be called regularly on the executor's thread."""
        if (self._overlap_since is not None
                and time.monotonic() - self._overlap_since > _OVERLAP):
            self._drop_old()
        wanted, present = self._wanted(), self.qos_profile
        if (wanted.reliability, wanted.durability) == (present.reliability, present.durability):
            return
        self._drop_old()
        self._old, self._new = self._new, self._subscribe(wanted)

    def _wanted(self) -> QoSProfile:
        offers = [publisher.qos_profile for publisher in self.publishers()]
        if not offers:
            return self.qos_profile
        reliable = self._reliability == 'reliable' if self._reliability != 'auto' else all(
            offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
        latched = self._latched and all(
            offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
        return QoSProfile(
            depth=self._depth,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched
            else DurabilityPolicy.VOLATILE)

    def _subscribe(self, qos: QoSProfile) -> Subscription:
        self._generation = generation = object()
        return self._node.create_subscription(
            self._kind, self._topic, partial(self._receive, generation), qos,
            # a mismatch is resolved here, or explained by the watchdog
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False))

    def _receive(self, generation: object, message: Any) -> None:
        self.received_at = time.monotonic()
        if self._old is not None:
            if generation is self._generation and self._overlap_since is None:
                self._overlap_since = self.received_at
            # a calibration may be taken twice, and many have no stamp
            stamp = to_stamp(message.header.stamp)
            if not self._latched and stamp in self._taken:
                return
            self._taken.append(stamp)
        self._take(message)

    def _drop_old(self) -> None:
        if self._old is not None:
            self._node.destroy_subscription(self._old)
            self._old, self._overlap_since = None, None
            self._taken.clear()


def image_subscription(node: Node, name: str, transport: str, take: Callable[[Any], None],
                       settings: NodeSettings) -> AdaptiveSubscription:
    """Subscribe to images of a transport, by the topic name of image_transport."""
    kind, suffix = (Image, '') if transport == 'raw' else (CompressedImage, f'/{transport}')
    return AdaptiveSubscription(node, kind, name, take, settings.topic_queue_size,
                                settings.qos_reliability, suffix)


def camera_info_subscription(node: Node, name: str,
                             take: Callable[[CameraInfo], None]) -> AdaptiveSubscription:
    """Subscribe to calibrations, also those that were published once before."""
    return AdaptiveSubscription(node, CameraInfo, name, take, _CAMERA_INFO_QUEUE, latched=True)
