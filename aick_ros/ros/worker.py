# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A thread beside the executor that works on frames, so that no callback waits for them."""

from __future__ import annotations

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
    """

    def __init__(self, work: Callable[[Any], None], capacity: int,
                 ready: Callable[[Any], bool] = lambda item: True) -> None:
        self._work = work
        self._capacity = capacity
        self._ready = ready
        self._items: deque[Any] = deque()
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

    def put(self, item: Any) -> None:
        """Queue an item for the thread."""
        with self._wake:
            while len(self._items) >= self._capacity:
                self._items.popleft()
                self.dropped += 1
            self._items.append(item)
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
                item = None if errand else self._items.popleft()
            if errand:
                errand()
            else:
                self._work(item)

    def _has_work(self) -> bool:
        return (self._stopping or bool(self._errands)
                or (bool(self._items) and self._ready(self._items[0])))
