# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A thread beside the executor that works on frames, so that no callback waits for them."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from typing import Any


class Worker:
    """
    Hands items to one thread, in order.

    :param work: called with each item on the worker's thread; it must not raise.
    :param capacity: items that wait at most; the oldest is dropped for a new one. With 1 the
        worker always gets the newest.
    :param ready: whether work can be done on an item; until then it waits in the queue.
    :param size: of an item [bytes].
    :param max_bytes: of the items that wait; the newest waits however large it is.
    """

    def __init__(self, work: Callable[[Any], None], capacity: int,
                 ready: Callable[[Any], bool] = lambda item: True,
                 size: Callable[[Any], int] = lambda item: 0, max_bytes: float = math.inf) -> None:
        self._work = work
        self._capacity, self._max_bytes = capacity, max_bytes
        self._ready, self._size = ready, size
        self._items: deque[Any] = deque()
        self._bytes = 0
        self._errands: deque[Callable[[], None]] = deque()
        self._wake = threading.Condition()
        self._stopping = False
        self.dropped = 0
        self._thread = threading.Thread(target=self._run, name='odometry', daemon=True)
        self._thread.start()

    @property
    def backlog(self) -> int:
        """How many items wait."""
        return len(self._items)

    @property
    def backlog_bytes(self) -> int:
        """How large the items that wait are together [bytes]."""
        return self._bytes

    def put(self, item: Any) -> None:
        """Queue an item for the thread."""
        size = self._size(item)
        with self._wake:
            while self._items and (len(self._items) >= self._capacity
                                   or self._bytes + size > self._max_bytes):
                self._take()
                self.dropped += 1
            self._items.append(item)
            self._bytes += size
            self._wake.notify()

    def run(self, errand: Callable[[], None]) -> None:
        """Have the thread do something between two items, before those that wait."""
        with self._wake:
            self._errands.append(errand)
            self._wake.notify()

    def nudge(self) -> None:
        """Have the thread look again whether it can work."""
        with self._wake:
            self._wake.notify()

    def stop(self, timeout: float) -> None:
        """End the thread after the item at hand, waiting at most ``timeout`` [s]."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join(timeout)

    def _run(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(self._has_work)
                if self._stopping:
                    return
                errand = self._errands.popleft() if self._errands else None
                item = None if errand else self._take()
            if errand:
                errand()
            else:
                self._work(item)

    def _take(self) -> Any:
        item = self._items.popleft()
        self._bytes -= self._size(item)
        return item

    def _has_work(self) -> bool:
        return (self._stopping or bool(self._errands)
                or (bool(self._items) and self._ready(self._items[0])))
