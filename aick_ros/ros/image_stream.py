# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The images of the camera while they are subscribed to, and what is missing of them."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from aick_ros.messages.synchronizer import Pair
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input.assembler import FrameAssembler
from aick_ros.ros.input.pairing import Pairing
from aick_ros.ros.input.rgbd_images import rgbd_subscription
from aick_ros.ros.input.subscriptions import AdaptiveSubscription, image_subscription
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.input.watchdog import Watchdog
from aick_ros.settings import NodeSettings

_SILENCE = 0.5  # seconds without an image after which no better partner is expected; chosen


class ImageStream:
    """
    Subscribes to the images of a camera and pairs them, on the executor's thread.

    :param assembler: whose subscriptions are tended, too.
    :param on_pair: called with each pair.
    :param on_colour: called with the stamp of each colour image that is accepted [ns].
    """

    def __init__(self, node: Node, settings: NodeSettings, assembler: FrameAssembler,
                 transforms: Transforms, diagnostics: Diagnostics,
                 on_pair: Callable[[Pair], None], on_colour: Callable[[int], None]) -> None:
        self._node, self._assembler, self._transforms = node, assembler, transforms
        self._pairing = Pairing(node, settings, diagnostics, on_pair, on_colour)
        self._images = self._subscribe(settings)
        self._subscriptions = [*self._images, *assembler.subscriptions]
        self._watchdog = Watchdog(node, settings, self._subscriptions, self._pairing)
        # a steady timer: a /clock that stands still must not stop it
        self._timer = node.create_timer(
            _SILENCE / 2, self._tend, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def newest(self) -> Pair | None:
        """The last pair; None before the first."""
        return self._pairing.newest

    @property
    def counts(self) -> dict[Count, int]:
        """Numbers of images that did not arrive or found no partner."""
        return self._pairing.counts

    def close(self) -> None:
        """Unsubscribe from the images."""
        self._node.destroy_timer(self._timer)
        for subscription in self._images:
            subscription.close()

    def complaint(self) -> str:
        """Return what is missing at the inputs, '' for nothing."""
        newest = self._pairing.newest
        return (self._watchdog.complaint_about_topics()
                or (self._assembler.missing_for(newest) if newest else '')
                or self._watchdog.complaint_about_clocks()
                or self._watchdog.complaint_about_losses())

    def _subscribe(self, settings: NodeSettings) -> list[AdaptiveSubscription]:
        if settings.subscribe_rgbd:
            return [rgbd_subscription(self._node, settings, self._assembler, self._pairing)]
        return [image_subscription(self._node, 'rgb/image', settings.image_transport,
                                   self._pairing.take_colour, settings),
                image_subscription(self._node, 'depth/image', settings.depth_transport,
                                   self._pairing.take_depth, settings)]

    def _tend(self) -> None:
        if self._watchdog.silent_for() > _SILENCE:
            self._pairing.flush()
        for subscription in self._subscriptions:
            subscription.adapt()
        self._transforms.tend()
