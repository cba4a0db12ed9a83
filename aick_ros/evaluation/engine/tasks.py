# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tasks that are run through crashes, hangs and lost processes, each with one outcome."""

from __future__ import annotations

import math
import os
import queue
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, Generic, TypeVar

from aick_ros.borders.allocator import keep_freed_memory
from aick_ros.borders.no_memory import is_of_memory
from aick_ros.errors import InputError, TransferError
from aick_ros.evaluation.engine.time_limit import time_limit
from aick_ros.evaluation.engine.versions import (
    OtherVersionsError, Versions, other_versions, own_versions)

if TYPE_CHECKING:
    from distributed import Client, Future

Argument = TypeVar('Argument')
Value = TypeVar('Value')

_POLL_INTERVAL = 0.05  # [s] between two looks for what has ended; chosen
_LATENCY = 1.0  # [s] most between a start and the news of it; chosen for a busy machine
_OUT_OF_MEMORY = 'worker-restart-memory'  # where Dask reports the processes that it ends
_LONGEST = 300  # characters of a reason; chosen


class Cause(Enum):
    """Kind of a failure; the value is its description for people."""

    INPUT = 'unusable input'
    TRANSFER = 'transfer'
    DEFECT = 'exception'
    TIME = 'time limit'
    MEMORY = 'out of memory'
    LOST = 'process lost'

    @property
    def is_of_the_input(self) -> bool:
        """Another run would fail in the same way."""
        return self is Cause.INPUT


@dataclass(frozen=True)
class Failure:
    """End of a task without a value; the reason is a sentence."""

    cause: Cause
    reason: str


@dataclass(frozen=True)
class Outcome(Generic[Argument, Value]):
    """
    What became of a task.

    :param value: what its function returned, or why it did not.
    :param attempts: number of processes that it was started in.
    :param worker: address of the last of them.
    """

    argument: Argument
    value: Value | Failure
    attempts: int
    worker: str


@dataclass(frozen=True)
class Limits:
    """
    What a task may use.

    :param seconds: longest time of an attempt.
    :param attempts: number of processes lost with it after which it is given up.
    """

    seconds: float = math.inf
    attempts: int = 3  # chosen


def run_tasks(client: Client, function: Callable[[Argument], Value], arguments: Sequence[Argument],
              limits: Limits = Limits(), is_stopped: Callable[[], bool] = lambda: False,
              say: Callable[[str], None] = lambda text: None
              ) -> Iterator[Outcome[Argument, Value]]:
    """
    Call a function with each argument, a task each, and yield each outcome as it is there.

    A task whose process is lost is tried again in another; one that takes too long or too much
    memory is not, and its process is replaced.

    :param function: called on a worker, which imports its module.
    :param is_stopped: called several times a second; the remaining tasks are cancelled then.
    :param say: called with sentences for the user.
    :raises InputError: where the scheduler is lost.
    """
    tasks = _Tasks(client, function, arguments, limits, say)
    try:
        while tasks.are_left and not is_stopped():
            outcomes = list(tasks.ended())
            yield from outcomes
            if not outcomes:
                time.sleep(_POLL_INTERVAL)
    finally:
        tasks.cancel()


@dataclass(eq=False)
class _Task(Generic[Argument, Value]):
    argument: Argument
    future: Future[Value | Failure]
    attempts: int = 0
    worker: str = ''
    process: int = 0
    start: float = math.inf


class _Tasks(Generic[Argument, Value]):
    """The tasks without an outcome yet, by the key of their first attempt."""

    def __init__(self, client: Client, function: Callable[[Argument], Value],
                 arguments: Sequence[Argument], limits: Limits,
                 say: Callable[[str], None]) -> None:
        from distributed import as_completed
        self._client, self._limits, self._say = client, limits, say
        self._topic = f'{function.__name__}-{uuid.uuid4()}'
        self._news: queue.SimpleQueue[tuple[float, dict[str, str | int]]] = queue.SimpleQueue()
        self._without_memory: set[int] = set()
        client.subscribe_topic(
            self._topic, lambda event: self._news.put((time.monotonic(), event[1])))
        client.subscribe_topic(
            _OUT_OF_MEMORY, lambda event: self._without_memory.add(event[1]['pid']))
        self._function = partial(_attempt, function, self._topic, limits.seconds, own_versions())
        keys = [f'{self._topic}-{number}' for number in range(len(arguments))]
        futures = client.map(self._function, arguments, keys, key=keys, pure=False)
        self._tasks = {key: _Task(argument, future)
                       for key, argument, future in zip(keys, arguments, futures)}
        self._keys = {future: key for key, future in zip(keys, futures)}
        self._completed = as_completed(futures)

    @property
    def are_left(self) -> bool:
        """A task has no outcome yet."""
        return bool(self._tasks)

    def ended(self) -> Iterator[Outcome[Argument, Value]]:
        """Yield the outcomes that are there; tasks whose process was lost are tried again."""
        futures = self._completed.next_batch(block=False)
        while not self._news.empty():  # after the futures: a start is reported before its end
            self._note_start(*self._news.get())
        for future in futures:
            key = self._keys.pop(future)
            value = self._value(self._tasks[key], future)
            if value is None:
                self._try_again(key)
            else:
                task = self._tasks.pop(key)
                yield Outcome(task.argument, value, task.attempts, task.worker)

    def cancel(self) -> None:
        """Cancel the tasks that are left."""
        self._client.unsubscribe_topic(self._topic)
        self._client.cancel([task.future for task in self._tasks.values()])

    def _note_start(self, when: float, start: dict[str, str | int]) -> None:
        task = self._tasks.get(str(start['key']))
        if task is not None:
            task.attempts, task.start = task.attempts + 1, when
            task.worker, task.process = str(start['worker']), int(start['process'])

    def _value(self, task: _Task[Argument, Value],
               future: Future[Value | Failure]) -> Value | Failure | None:
        """Return what a task ended with; None where it is to be tried again."""
        from distributed import KilledWorker
        if future.status == 'cancelled':
            raise InputError('the scheduler was lost: the same command resumes')
        try:
            return future.result()
        except KilledWorker:
            return self._loss(task)
        except OtherVersionsError as error:
            self._say(str(error))
            self._client.retire_workers([task.worker])
            return None
        except Exception as error:  # not of the task, but of its way to the worker and back
            return failure_of(error)

    def _loss(self, task: _Task[Argument, Value]) -> Failure | None:
        """Return the failure of a task whose process was lost; None if it may be tried again."""
        if time.monotonic() - task.start > self._limits.seconds - _LATENCY:
            return Failure(Cause.TIME, f'took longer than {self._limits.seconds:g} s')
        if task.process in self._without_memory:
            return Failure(Cause.MEMORY, 'used more memory than its process may')
        if task.attempts >= self._limits.attempts:
            return Failure(Cause.LOST, f'crashed or was killed in {task.attempts} processes')
        return None

    def _try_again(self, key: str) -> None:
        task = self._tasks[key]
        task.start = math.inf
        # a new name: with the old one it could have ended before it is asked to start again
        task.future = self._client.submit(self._function, task.argument, key, pure=False,
                                          key=f'{key}-{uuid.uuid4()}')
        self._keys[task.future] = key
        self._completed.add(task.future)


def _attempt(function: Callable[[Argument], Value], topic: str, seconds: float,
             versions: Versions, argument: Argument, key: str) -> Value | Failure:
    """Call the function on a worker that keeps its memory, and report the start."""
    from distributed import get_worker
    from distributed.utils import sync
    worker = get_worker()
    # waited for: what is only on its way would be lost with the process
    sync(worker.loop, worker.scheduler.log_event, topic=topic, msg={
        'key': key, 'worker': worker.address, 'process': os.getpid()})
    other = other_versions(own_versions(), versions)
    if other:
        raise OtherVersionsError(f'the worker {worker.address} is rejected: {other}')
    keep_freed_memory()
    try:
        with open(os.devnull, 'w') as nowhere, time_limit(seconds, nowhere):
            return function(argument)
    except (Exception, SystemExit) as error:
        return failure_of(error)


def failure_of(error: BaseException) -> Failure:
    """Return the failure of a task that raised an exception."""
    if isinstance(error, TransferError):
        return Failure(Cause.TRANSFER, _shortened(str(error)))
    if isinstance(error, InputError):
        return Failure(Cause.INPUT, _shortened(str(error)))
    if is_of_memory(error):
        return Failure(Cause.MEMORY, 'used more memory than there is, or is allowed (ulimit -v)')
    return Failure(Cause.DEFECT, _shortened(f'{type(error).__name__}: {error}'))


def _shortened(reason: str) -> str:
    """Return a reason that is not too long, without half a word at its end."""
    if len(reason) <= _LONGEST:
        return reason
    beginning = reason[:_LONGEST - 4]
    return f'{beginning.rpartition(" ")[0] or beginning} ...'
