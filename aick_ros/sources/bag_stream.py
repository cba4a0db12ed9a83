# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The images of one topic of a bag, their stamps strictly increasing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER
from aick_ros.geometry.trajectory import stamp_to_seconds
from aick_ros.messages.stamp_monitor import StampMonitor


class StampedMessage(NamedTuple):
    """An image message and the stamp of its header [ns]."""

    stamp: int
    message: Any


class BagStream:
    """
    Drops images whose stamps cannot be used, by the rule for live images and one of its own.

    In a recording the next image is known: a stamp that jumps ahead is stray too where the next
    one goes back. So the first image, and each one after a gap of more than a second, is kept
    until the next one arrives.

    :param on_dropped: called with the stamp [ns] of each dropped image, and the reason.
    """

    def __init__(self, on_dropped: Callable[[int, str], None]) -> None:
        self._on_dropped = on_dropped
        self._monitor = StampMonitor()
        self._kept: StampedMessage | None = None
        self._last = 0  # stamp of the last image that was handed on [ns]

    def add(self, image: StampedMessage, log_time: int) -> list[StampedMessage]:
        """
        Add the next image of the bag.

        :param log_time: when it was recorded [ns].
        :returns: the images that are now certain, at most two.
        """
        fault = self._monitor.check(image.stamp, log_time / NANOSECONDS)
        kept, newest = self._kept, self._last if self._kept is None else self._kept.stamp
        if fault:
            self._on_dropped(image.stamp, fault)
            return []
        if kept is not None and self._last < image.stamp < kept.stamp - RESTART_AFTER:
            self._on_dropped(kept.stamp, 'the stamp is far ahead of '
                             f'{stamp_to_seconds(image.stamp)}, which follows')
            self._kept = None
        elif image.stamp <= newest:
            self._on_dropped(image.stamp, 'the stamp repeats or goes back from '
                             f'{stamp_to_seconds(newest)}')
            return []
        certain = self.flush()
        if image.stamp - self._last > RESTART_AFTER:
            self._kept = image
            return certain
        self._last = image.stamp
        return [*certain, image]

    def flush(self) -> list[StampedMessage]:
        """Return the image that is kept, none or one; call it when no more will come."""
        kept, self._kept = self._kept, None
        if kept is None:
            return []
        self._last = kept.stamp
        return [kept]
