# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A thread beside the executor that does the jobs of a queue, so that no callback is delayed."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Generic

from aick_ros.ros.work_queue import Item, Job, WorkQueue


class Worker(Generic[Item]):
    """
    Does the jobs of a queue, one after the other, on a thread of its own.

    :param work: called with each item; it must not raise.
    :param is_ready: whether an item can be worked on; until then it stays in the queue.
    :param name: of the thread.
    :param waited: returns the time that the calling thread has waited within its work [s].
    """

    def __init__(self, queue: WorkQueue[Item], work: Callable[[Item], None],
                 is_ready: Callable[[Item], bool] = lambda item: True,
                 name: str = 'odometry', waited: Callable[[], float] = lambda: 0.0) -> None:
        self._queue, self._work, self._is_ready = queue, work, is_ready
        self._waited = waited
        self._busy = 0.0
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    @property
    def dropped(self) -> int:
        """Number of items dropped for newer ones since the start, or the last draining."""
        return self._queue.dropped

    @property
    def busy(self) -> tuple[float, ...]:
        """Time that the thread has worked, without waits and the job at hand [s]."""
        return self._busy,

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def put_task(self, task: Job) -> None:
        """Append a task, to be done between two items."""
        self._queue.put_task(task)

    def drain(self) -> None:
        """
        Drop the items that wait; return once the job at hand and the tasks that wait are done.

        The thread must run.
        """
        self._queue.clear()
        done = threading.Event()
        self._queue.put_task(done.set)
        done.wait()

    def stop(self) -> None:
        """
        Close the queue and wait until the job at hand is done.

        A thread that outlived the interpreter would abort the process inside OpenCV.
        """
        self._queue.close()
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        while (job := self._queue.take(self._work, self._is_ready)) is not None:
            begun = time.monotonic() - self._waited()
            job()
            self._busy += time.monotonic() - self._waited() - begun
