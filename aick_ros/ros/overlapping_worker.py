# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Two threads beside the executor: one prepares an item while the other works on the last one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

from aick_ros.ros.work_queue import Item, Job, WorkQueue
from aick_ros.ros.worker import Worker

Prepared = TypeVar('Prepared')


class OverlappingWorker(Generic[Item, Prepared]):
    """
    Does the jobs of a queue as :class:`Worker` does, in the same order, each in two halves.

    At most one item is prepared ahead. Where the queue keeps the newest item only, a newer one
    replaces it: an item waits no longer for being prepared.

    :param prepare: called with each item on a thread of its own; None: there is nothing to work
        on. It must not raise.
    :param work: called with what was prepared, between tasks; it must not raise.
    :param is_ready: whether an item can be prepared; until then it stays in the queue.
    :param waited: returns the time that the calling thread has waited within its work [s].
    """

    def __init__(self, queue: WorkQueue[Item], prepare: Callable[[Item], Prepared | None],
                 work: Callable[[Prepared], None],
                 is_ready: Callable[[Item], bool] = lambda item: True,
                 waited: Callable[[], float] = lambda: 0.0) -> None:
        self._queue, self._prepare, self._work, self._is_ready = queue, prepare, work, is_ready
        self._ahead: WorkQueue[Prepared] = WorkQueue(capacity=1)
        self._first = Worker(queue, self._prepare_ahead, self._can_prepare, 'preparation',
                             waited)
        self._second = Worker(self._ahead, self._work_on, waited=waited)

    @property
    def dropped(self) -> int:
        """Number of items dropped for newer ones since the start, or the last draining."""
        return self._first.dropped + self._second.dropped

    @property
    def busy(self) -> tuple[float, ...]:
        """Time that each thread has worked, without waits and the jobs at hand [s]."""
        return self._first.busy + self._second.busy

    def start(self) -> None:
        """Start the threads."""
        self._first.start()
        self._second.start()

    def put_task(self, task: Job) -> None:
        """Append a task, to be done between two items; it goes before one prepared ahead."""
        self._second.put_task(task)

    def drain(self) -> None:
        """
        Drop the items that wait; return once the job at hand and the tasks that wait are done.

        The threads must run.
        """
        self._first.drain()
        self._second.drain()

    def stop(self) -> None:
        """Close the queue and wait until the jobs at hand are done."""
        self._first.stop()
        self._second.stop()

    def _can_prepare(self, item: Item) -> bool:
        return (self._queue.keeps_newest or not self._ahead.backlog) and self._is_ready(item)

    def _prepare_ahead(self, item: Item) -> None:
        prepared = self._prepare(item)
        if prepared is not None:
            self._ahead.put(prepared)

    def _work_on(self, prepared: Prepared) -> None:
        self._queue.wake()  # the next one can be prepared
        self._work(prepared)
