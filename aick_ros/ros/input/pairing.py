# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs of colour and depth images with trustworthy stamps."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.node import Node

from aick_ros.borders.names import quoted
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.messages.stamp_monitor import StampMonitor
from aick_ros.messages.synchronizer import Pair, Synchronizer
from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input.subscriptions import image_topics
from aick_ros.settings.node import NodeSettings

_THROTTLE = 5.0  # seconds between two log lines of the same kind; chosen
_ARRIVALS_KEPT = 100  # images; chosen


class Pairing:
    """
    Pairs images on the executor's thread.

    :param on_pair: called with each pair.
    :param on_colour: called with the stamp of each colour image that is accepted [ns].
    :ivar newest: the last pair; None before the first.
    :ivar ahead: time from the node's clock to the stamp of the last accepted image when it came
        [ns]; 0 before the first, and while the clock is not known.
    :ivar paired_at: steady time of the last pair, or of the construction [s].
    :ivar rejected_at: steady time at which an image was last rejected [s], with ``rejection``,
        the reason.
    """

    def __init__(self, node: Node, settings: NodeSettings, diagnostics: Diagnostics,
                 on_pair: Callable[[Pair], None], on_colour: Callable[[int], None]) -> None:
        self._logger, self._diagnostics = node.get_logger(), diagnostics
        self._on_pair, self._on_colour = on_pair, on_colour
        self._clock = node.get_clock()
        self._registers_depth = settings.register_depth
        self._synchronizer = Synchronizer(_max_interval(settings), settings.sync_queue_size)
        self._names = image_topics(settings)
        self._colour, self._depth = StampMonitor(), StampMonitor()
        self._arrivals = {name: deque[float](maxlen=_ARRIVALS_KEPT) for name in self._names}
        self.newest: Pair | None = None
        self.ahead = 0
        self.paired_at = time.monotonic()
        self.rejected_at, self.rejection = -math.inf, ''

    @property
    def counts(self) -> dict[Count, int]:
        """Numbers of images that did not arrive or found no partner."""
        unpaired = self._synchronizer.unpaired
        return {Count.COLOUR_UNPAIRED: unpaired['colour'],
                Count.DEPTH_UNPAIRED: unpaired['depth'],
                Count.COLOUR_MISSING: self._colour.missing,
                Count.DEPTH_MISSING: self._depth.missing}

    @property
    def missing_shares(self) -> dict[str, float]:
        """Share of the recent images that did not arrive, by unresolved topic name."""
        return dict(zip(self._names, (self._colour.missing_share, self._depth.missing_share)))

    def recent_counts(self, seconds: float) -> dict[str, int]:
        """Return how many images were accepted in the last seconds, at most 100, by topic name."""
        since = time.monotonic() - seconds
        return {name: sum(at >= since for at in arrivals)
                for name, arrivals in self._arrivals.items()}

    def take_colour(self, message: Any) -> None:
        """Take a colour image."""
        stamp = to_stamp(message.header.stamp)
        if self._accepts(self._names[0], self._colour, message):
            self._add(self._names[0], stamp,
                      partial(self._synchronizer.add_colour, stamp, message))

    def take_depth(self, message: Any) -> None:
        """Take a depth image."""
        stamp = to_stamp(message.header.stamp)
        if self._accepts(self._names[1], self._depth, message):
            self._add(self._names[1], stamp,
                      partial(self._synchronizer.add_depth, stamp, message))

    def take_pair(self, pair: Pair) -> None:
        """Take two images that belong together."""
        if (self._accepts(self._names[0], self._colour, pair.colour)
                and self._accepts(self._names[1], self._depth, pair.depth)):
            self._add(self._names[0], pair.colour_stamp,
                      partial(self._synchronizer.add_pair, pair))

    def reject(self, name: str, fault: str) -> None:
        """Count and report what was received on a topic and cannot be used."""
        self._diagnostics.count(Count.IMAGES_REJECTED)
        self.rejected_at, self.rejection = time.monotonic(), f'image on {name} rejected: {fault}'
        self._logger.warning(self.rejection, throttle_duration_sec=_THROTTLE)

    def flush(self) -> None:
        """Pair the images that wait for a better partner, which will not come."""
        self._pass_on(self._synchronizer.flush())

    def _accepts(self, name: str, stream: StampMonitor, message: Any) -> bool:
        stamp = message.header.stamp
        fault = _fault(stamp) or stream.check(to_stamp(stamp), time.monotonic())
        if fault:
            self.reject(name, fault)
        else:
            self._arrivals[name].append(time.monotonic())
        return not fault

    def _add(self, name: str, stamp: int, add: Callable[[], list[Pair]]) -> None:
        """Pass on the pairs that an image completes, unless its stamp is late."""
        late, now = self._synchronizer.late, self._clock.now().nanoseconds
        self.ahead = stamp - now if now else 0
        self._pass_on(add())
        if self._synchronizer.late > late:
            self.reject(name, f'its stamp of {stamp} ns repeats or goes back; does the driver '
                              'publish twice, or the network change the order?')
        elif name == self._names[0]:
            self._on_colour(stamp)

    def _pass_on(self, pairs: list[Pair]) -> None:
        for pair in pairs:
            self._diagnostics.count(Count.RECEIVED)
            self.newest, self.paired_at = pair, time.monotonic()
            self._check_frames(pair.colour.header.frame_id, pair.depth.header.frame_id)
            self._on_pair(pair)

    def _check_frames(self, colour_frame: str, depth_frame: str) -> None:
        if depth_frame != colour_frame and not self._registers_depth:
            self._logger.warning(
                f'depth images are of frame {quoted(depth_frame)}, colour images of '
                f'{quoted(colour_frame)}: if the driver does not register depth to colour, set '
                'register_depth to true',
                once=True)


def _fault(stamp: Time) -> str:
    """Return why a stamp is no time, '' where it is one."""
    if stamp.nanosec < NANOSECONDS:
        return ''
    return (f'its stamp has {stamp.nanosec} ns beside the seconds, at most {NANOSECONDS - 1} are '
            'a time; the driver must stamp its images')


def _max_interval(settings: NodeSettings) -> float:
    """Return the largest difference of the stamps of a pair [s]; 0: equal stamps only."""
    if not settings.approx_sync:
        return 0.0
    return settings.approx_sync_max_interval or math.inf
