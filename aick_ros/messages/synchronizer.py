# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairing of colour images with depth images by stamp, as they arrive."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

_GAPS_KEPT = 30  # chosen: the last second at 30 Hz
_GAP_MARGIN = 0.8  # chosen; the next gap may be this much shorter than the recent ones


class Pair(NamedTuple):
    """A colour image and the depth image nearest in time; stamps in ns, images as added."""

    colour_stamp: int
    colour: Any
    depth_stamp: int
    depth: Any


@dataclass
class _Stream:
    queue: deque[tuple[int, Any]] = field(default_factory=deque)
    gaps: deque[int] = field(default_factory=lambda: deque(maxlen=_GAPS_KEPT))
    last: int | None = None
    unpaired: int = 0

    def append(self, stamp: int, image: Any) -> None:
        if self.last is not None:
            self.gaps.append(stamp - self.last)
        self.last = stamp
        self.queue.append((stamp, image))

    def may_bring_nearer(self, interval: int) -> bool:
        """Return whether a later image may be nearer than the head, at ``interval`` [ns]."""
        return 2 * interval > _GAP_MARGIN * min(self.gaps, default=0)

    def drop_head(self) -> None:
        self.queue.popleft()
        self.unpaired += 1

    def restart(self) -> None:
        self.unpaired += len(self.queue)
        self.queue.clear()
        self.last = None


class Synchronizer:
    """
    Pairs two streams of stamped images, each used at most once, in order.

    A pair is returned as soon as no later image can fit better: at once where the two stamps
    differ by less than half a period, otherwise after one more image. So the pairs do not depend
    on which stream's image arrives first, and a live camera and a recording of it have the same
    pairs.

    :param max_interval: largest difference of the stamps of a pair [s]; 0: equal stamps only;
        infinity: no limit.
    :param queue_size: largest number of images of one stream that wait for a partner; None: any.
    """

    def __init__(self, max_interval: float = 0.02, queue_size: int | None = None) -> None:
        interval = max_interval * NANOSECONDS  # infinite, too, where the number is very large
        self._max_interval = interval if math.isinf(interval) else round(interval)
        self._queue_size = queue_size
        self._colour = _Stream()
        self._depth = _Stream()
        self._late = 0

    @property
    def unpaired(self) -> dict[str, int]:
        """Number of images of each stream that were dropped without a partner."""
        return {'colour': self._colour.unpaired, 'depth': self._depth.unpaired}

    @property
    def late(self) -> int:
        """Number of images that were rejected because their stamp repeats or goes back."""
        return self._late

    def add_colour(self, stamp: int, image: Any) -> list[Pair]:
        """Add a colour image with its stamp [ns]; return the pairs that are now certain."""
        return self._add(self._colour, stamp, image)

    def add_depth(self, stamp: int, image: Any) -> list[Pair]:
        """Add a depth image with its stamp [ns]; return the pairs that are now certain."""
        return self._add(self._depth, stamp, image)

    def add_pair(self, pair: Pair) -> list[Pair]:
        """Add two images that belong together; return them unless their stamp is late."""
        if self._is_late(self._colour, pair.colour_stamp):
            return []
        self._colour.last, self._depth.last = pair.colour_stamp, pair.depth_stamp
        return [pair]

    def flush(self) -> list[Pair]:
        """Return the pairs that wait for a later image; call it when none will come."""
        return self._take_pairs(ended=True)

    def _is_late(self, stream: _Stream, stamp: int) -> bool:
        """Return whether a stamp repeats or goes back; far back, the streams start again."""
        if stream.last is None or stamp > stream.last:
            return False
        if stream.last - stamp <= RESTART_AFTER:
            self._late += 1
            return True
        for other in (self._colour, self._depth):
            if other.last is not None and other.last - stamp > RESTART_AFTER:
                other.restart()  # unless it has restarted already
        return False

    def _add(self, stream: _Stream, stamp: int, image: Any) -> list[Pair]:
        if self._is_late(stream, stamp):
            return []
        stream.append(stamp, image)
        pairs = self._take_pairs(ended=False)
        while self._queue_size is not None and len(stream.queue) > self._queue_size:
            stream.drop_head()
        return pairs

    def _take_pairs(self, ended: bool) -> list[Pair]:
        pairs = []
        colour, depth = self._colour, self._depth
        while colour.queue and depth.queue:
            older, newer = sorted((colour, depth), key=lambda stream: stream.queue[0][0])
            interval = newer.queue[0][0] - older.queue[0][0]
            if interval > self._max_interval:
                older.drop_head()
                continue
            fits = _fits(older, newer, ended)
            if fits is None:
                break
            if fits:
                pairs.append(Pair(*colour.queue.popleft(), *depth.queue.popleft()))
            else:
                older.drop_head()
        return pairs


def _fits(older: _Stream, newer: _Stream, ended: bool) -> bool | None:
    """Return whether the two heads are a pair; None where a later image decides it."""
    interval = newer.queue[0][0] - older.queue[0][0]
    if len(older.queue) == 1:
        return None if not ended and older.may_bring_nearer(interval) else True
    rival = abs(older.queue[1][0] - newer.queue[0][0])
    if rival >= interval:
        return True
    # the older stream's next image fits better, unless it has a better partner itself
    if len(newer.queue) == 1:
        return None if not ended and newer.may_bring_nearer(rival) else False
    return abs(newer.queue[1][0] - older.queue[1][0]) < rival
