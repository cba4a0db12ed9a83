# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Subscriptions whose QoS matches that of the publishers."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from aick_ros.geometry.stamps import RESTART_AFTER
from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.input.waiting_messages import waiting_messages
from aick_ros.settings.node import NodeSettings

_CAMERA_INFO_QUEUE = 10


class AdaptiveSubscription:
    """
    Subscribes again when the publishers offer another QoS than was requested.

    The first message of the new subscription ends the old one. What still waits in the queue of
    the old one is taken before it, as far as it is older; what the old one already brought is
    not taken again. So images stay in order, and none is missed or taken twice, however late
    the executor takes them.

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
        self._old: Subscription | None = None
        self._last: int | None = None  # stamp of the last message taken [ns]
        self._repeats_left = 0  # largest number of further messages that may be repeated
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

    def close(self) -> None:
        """Unsubscribe; what waits in the queues is not taken."""
        for subscription in (self._old, self._new):
            if subscription is not None:
                self._node.destroy_subscription(subscription)
        self._old = None

    def adapt(self) -> None:
        """Match the QoS of the publishers; to be called regularly on the executor's thread."""
        wanted, present = self._wanted(), self.qos_profile
        if (wanted.reliability, wanted.durability) == (present.reliability, present.durability):
            return
        self._end_old()
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
        if generation is self._generation:
            self._end_old(message)
        self._pass_on(message)

    def _pass_on(self, message: Any) -> None:
        if self._repeats_left and self._last is not None and self._covers(self._last, message):
            self._repeats_left -= 1
            return
        self._repeats_left = 0
        self._last = to_stamp(message.header.stamp)
        self._take(message)

    def _end_old(self, first: Any = None) -> None:
        """Destroy the old subscription; take what it still holds from before ``first``."""
        if self._old is None:
            return
        for message in waiting_messages(self._old):
            if first is not None and self._covers(to_stamp(message.header.stamp), first):
                break  # the new subscription brings it and all that follow
            self._pass_on(message)
        self._node.destroy_subscription(self._old)
        self._old = None
        # the new one holds at most a queue of messages that the old one brought, and a reliable
        # one may have waited for a lost message meanwhile
        self._repeats_left = 2 * self._depth

    def _covers(self, stamp: int, message: Any) -> bool:
        """Return whether a stream that reached a stamp is at a message or beyond it."""
        # a calibration may be taken twice, and many have no stamp
        return not self._latched and (
            0 <= stamp - to_stamp(message.header.stamp) <= RESTART_AFTER)


def image_topics(settings: NodeSettings) -> tuple[str, str]:
    """Return the unresolved names of the topics with the colour and with the depth images."""
    if not settings.subscribe_rgbd:
        return 'rgb/image', 'depth/image'
    # as rgbd_odometry numbers them
    name = {0: 'rgbd_images', 1: 'rgbd_image'}.get(settings.rgbd_cameras, 'rgbd_image0')
    return name, name


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
