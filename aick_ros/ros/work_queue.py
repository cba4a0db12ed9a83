# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The queue between two threads, as the executor's and a worker's."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

Item = TypeVar('Item')
Job = Callable[[], None]


class WorkQueue(Generic[Item]):
    """
    Items in order of arrival, and tasks that go before them, for one thread.

    :param capacity: largest number of items; the oldest is dropped for a new one, so that with a
        capacity of 1 the newest item is the next.
    :param burst: number of items beyond it that may wait after the thread has waited for one; with
        the first that is dropped they may no longer, so that in a lasting overload none is older.
    :param size: returns the size of an item [bytes].
    :param max_bytes: largest total size of the items; one item is kept however large it is.
    :ivar dropped: number of items dropped for newer ones since the start, or the last clearing.
    """

    def __init__(self, capacity: int, size: Callable[[Item], int] = lambda item: 0,
                 max_bytes: float = math.inf, burst: int = 0) -> None:
        self._capacity, self._max_bytes, self._size = capacity, max_bytes, size
        self._burst, self._is_behind = burst, False
        self._items: deque[Item] = deque()
        self._bytes = 0
        self._tasks: deque[Job] = deque()
        self._changed = threading.Condition()
        self._is_closed = False
        self.dropped = 0

    @property
    def keeps_newest(self) -> bool:
        """A new item takes the place of the one that waits, but in a burst."""
        return self._capacity == 1

    @property
    def backlog(self) -> int:
        """Number of items that wait."""
        return len(self._items)

    @property
    def backlog_bytes(self) -> int:
        """Total size of the items that wait [bytes]."""
        return self._bytes

    def put(self, item: Item) -> None:
        """Append an item."""
        size = self._size(item)
        with self._changed:
            most = self._capacity + (0 if self._is_behind else self._burst)
            while self._items and (len(self._items) >= most
                                   or self._bytes + size > self._max_bytes):
                self._pop()
                self.dropped += 1
                self._is_behind = True
            self._items.append(item)
            self._bytes += size
            self._changed.notify()

    def put_task(self, task: Job) -> None:
        """Append a task; tasks are taken before the items that wait."""
        with self._changed:
            self._tasks.append(task)
            self._changed.notify()

    def clear(self) -> None:
        """Drop the items, uncounted, and restart the count; tasks stay."""
        with self._changed:
            self._items.clear()
            self._bytes = self.dropped = 0

    def wake(self) -> None:
        """Have the thread check again whether the oldest item is ready."""
        with self._changed:
            self._changed.notify()

    def close(self) -> None:
        """End the queue: what still waits is not taken any more."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()

    def take(self, work: Callable[[Item], None], is_ready: Callable[[Item], bool]) -> Job | None:
        """
        Wait for the next job and return it; None once the queue is closed.

        :param work: called with the oldest item by the job.
        :param is_ready: whether the oldest item can be worked on; until then it stays.
        """
        with self._changed:
            if not self._items:
                self._is_behind = False
            self._changed.wait_for(lambda: self._is_closed or self._tasks or (
                self._items and is_ready(self._items[0])))
            if self._is_closed:
                return None
            if self._tasks:
                return self._tasks.popleft()
            item = self._pop()
        return lambda: work(item)

    def _pop(self) -> Item:
        item = self._items.popleft()
        self._bytes -= self._size(item)
        return item
