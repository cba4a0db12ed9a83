# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs colour and depth messages whose stamps can be believed."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from aick_ros.messages.stamp_monitor import StampMonitor
from aick_ros.messages.synchronizer import Pair, Synchronizer
from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.health.counts import Count
from aick_ros.settings.node import NodeSettings


class Pairing:
    """
    Takes images on the executor's thread.

    :param on_pair: called with each pair.
    :param on_refused: called with the sentence that says why an image is left out.
    """

    def __init__(self, settings: NodeSettings, on_pair: Callable[[Pair], None],
                 on_refused: Callable[[str], None]) -> None:
        self._on_pair, self._on_refused = on_pair, on_refused
        self._synchronizer = Synchronizer(
            settings.approx_sync_max_interval if settings.approx_sync else 0.0,
            settings.sync_queue_size)
        self._streams = {'rgb/image': StampMonitor(), 'depth/image': StampMonitor()}
        self.newest_stamp = 0

    @property
    def counts(self) -> dict[Count, int]:
        """Images that did not arrive or found no partner."""
        unpaired = self._synchronizer.unpaired
        return {Count.COLOUR_UNPAIRED: unpaired['colour'],
                Count.DEPTH_UNPAIRED: unpaired['depth'],
                Count.COLOUR_MISSING: self._streams['rgb/image'].missing,
                Count.DEPTH_MISSING: self._streams['depth/image'].missing}

    @property
    def missing_shares(self) -> dict[str, float]:
        """Share of the images that did not arrive lately, by topic in the node's contract."""
        return {name: stream.missing_share for name, stream in self._streams.items()}

    def take_colour(self, message: Any) -> None:
        """Take a colour image."""
        self._take('rgb/image', self._synchronizer.add_colour, message)

    def take_depth(self, message: Any) -> None:
        """Take a depth image."""
        self._take('depth/image', self._synchronizer.add_depth, message)

    def flush(self) -> None:
        """Pair what waits for an image that will not come."""
        self._hand_on(self._synchronizer.flush())

    def _take(self, name: str, add: Callable[[int, Any], list[Pair]], message: Any) -> None:
        stamp, late = to_stamp(message.header.stamp), self._synchronizer.late
        fault = self._streams[name].check(stamp, time.monotonic())
        if fault:
            self._on_refused(f'image on {name} left out: {fault}')
        else:
            self.newest_stamp = stamp
            self._hand_on(add(stamp, message))
        if self._synchronizer.late > late:
            self._on_refused(f'image on {name} left out: its stamp of {stamp} ns repeats or goes '
                             'back; does the driver publish twice, or the network change the '
                             'order?')

    def _hand_on(self, pairs: list[Pair]) -> None:
        for pair in pairs:
            self._on_pair(pair)
