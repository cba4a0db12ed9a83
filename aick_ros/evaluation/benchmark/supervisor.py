# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Watches the process of one method on one recording, through crashes and hangs."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

import aick_ros
from aick_ros.evaluation.baselines.registry import Method
from aick_ros.evaluation.benchmark.journal import FrameLine, Line, PairLine
from aick_ros.evaluation.benchmark.recording import Pair, Recording

ONE_THREAD = {name: '1' for name in (
    'OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS', 'NUMEXPR_NUM_THREADS')}

_MOST_LOSSES = 3
_LIMIT_TO_START = 120.0  # [s]; a large library takes its time to load
_LIMIT_TO_READ = 120.0  # [s] from one frame to the next
_GLANCE = 0.1  # [s] between two looks at whether the user wants no more


class UnusableMethodError(Exception):
    """A method that is there but does not start."""


@dataclass(frozen=True)
class Job:
    """One method on some pairs of one recording."""

    method: Method
    recording: Recording
    pairs: Sequence[Pair]


class _Lost(Exception):
    """The process is gone or stuck; the message is the failure of what it was at."""


def supervise(job: Job, time_limit: float, record: Callable[[Line], None],
              is_stopped: Callable[[], bool]) -> None:
    """
    Do a job, in a new process after each crash or hang; what it died of counts as failed.

    :param time_limit: longest time for a frame or a pair [s].
    :param record: told of each frame and pair, from this thread.
    :param is_stopped: asked several times a second.
    :raises UnusableMethodError: where the method does not start.
    """
    remaining = dict.fromkeys(job.pairs)
    for _ in range(_MOST_LOSSES):
        watch = _Watch(job, list(remaining), time_limit, is_stopped)
        try:
            for line in watch.lines():
                if isinstance(line, PairLine):
                    del remaining[line.pair]
                record(line)
            return
        except _Lost as loss:
            for pair in watch.culprits(remaining):
                del remaining[pair]
                record(_failed(job, pair, str(loss)))
    for pair in remaining:
        record(_failed(job, pair, f'given up after {_MOST_LOSSES} crashes or hangs'))


class _Watch:
    """One process and what it is at."""

    def __init__(self, job: Job, pairs: Sequence[Pair], time_limit: float,
                 is_stopped: Callable[[], bool]) -> None:
        self._job, self._pairs = job, pairs
        self._time_limit, self._is_stopped = time_limit, is_stopped
        self._step: dict[str, Any] = {}
        self._is_ready = False

    def lines(self) -> Iterator[Line]:
        """Yield what the process measures, until it ends or is stopped."""
        with tempfile.TemporaryFile() as errors:
            process = self._start(errors)
            try:
                yield from self._follow(process, errors)
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)  # with what it has started itself
                process.wait()
                process.stdout.close()

    def culprits(self, remaining: Sequence[Pair]) -> list[Pair]:
        """Return the pairs that cannot be had because of the step it was lost in."""
        if 'pair' in self._step:
            return [Pair(*self._step['pair'])]
        if 'frame' in self._step:
            return [pair for pair in remaining if self._step['frame'] in pair]
        return list(remaining)

    def _start(self, errors: IO[bytes]) -> subprocess.Popen:
        here = str(Path(aick_ros.__file__).parents[1])
        path = os.pathsep.join(filter(None, (here, os.environ.get('PYTHONPATH'))))
        process = subprocess.Popen(
            [sys.executable, '-m', 'aick_ros.evaluation.benchmark.method_process'],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
            env={**os.environ, **ONE_THREAD, 'PYTHONPATH': path},
            start_new_session=True)  # Ctrl-C is for us; and a group of its own
        method = self._job.method
        with process.stdin as stream:
            stream.write(json.dumps({
                'factory': method.factory, 'options': dict(method.options),
                'request': self._job.recording.request.to_json(),
                'pairs': self._pairs}).encode() + b'\n')
        return process

    def _follow(self, process: subprocess.Popen, errors: IO[bytes]) -> Iterator[Line]:
        messages: queue.Queue[bytes | None] = queue.Queue()
        threading.Thread(target=_pump, args=(process.stdout, messages), daemon=True).start()
        while True:
            message = self._next(messages)
            if message is None:
                if self._is_stopped():
                    return
                raise self._death(process, errors)
            if 'end' in message:
                return
            if 'unusable' in message:
                raise UnusableMethodError(message['unusable'])
            self._is_ready = True
            self._step = message if 'step' in message else {}
            if 'ms' in message:
                yield self._line(message)

    def _next(self, messages: queue.Queue) -> dict[str, Any] | None:
        """Return the next message, None where there will be none."""
        limit = _LIMIT_TO_START
        if self._is_ready:
            limit = self._time_limit if self._step else max(_LIMIT_TO_READ, self._time_limit)
        end = time.monotonic() + limit
        while not self._is_stopped():
            try:
                line = messages.get(timeout=_GLANCE)
            except queue.Empty:
                if time.monotonic() > end:
                    raise self._lost(f'took longer than {limit:g} s') from None
                continue
            return None if line is None else json.loads(line)
        return None

    def _death(self, process: subprocess.Popen, errors: IO[bytes]) -> Exception:
        code = process.wait()
        errors.seek(0)
        last = errors.read().decode(errors='replace').strip().rpartition('\n')[2]
        cause = signal.Signals(-code).name if code < 0 else f'exit code {code}: {last[:200]}'
        return self._lost(f'crashed ({cause})')

    def _lost(self, failure: str) -> Exception:
        if not self._is_ready:
            return UnusableMethodError(f'{failure} while it was loaded')
        if not self._step:
            failure = f'{failure} between two frames'
        return _Lost(failure)

    def _line(self, message: dict[str, Any]) -> Line:
        job = self._job
        if 'frame' in message:
            return FrameLine(job.method.identity, job.recording.name, message['frame'],
                             message['ms'])
        pair, pose = Pair(*message['pair']), message['T_target_source']
        if pose is None:
            return _failed(job, pair, message['failure'], message['ms'])
        translation, rotation = job.recording.error(pair, np.array(pose))
        return PairLine(job.method.identity, job.recording.name, pair, translation, rotation,
                        message['ms'], '')


def _failed(job: Job, pair: Pair, failure: str, milliseconds: float | None = None) -> PairLine:
    return PairLine(job.method.identity, job.recording.name, pair, None, None, milliseconds,
                    failure)


def _pump(stream: IO[bytes], messages: queue.Queue) -> None:
    """Put the lines of a stream into a queue, and None after the last."""
    try:
        for line in stream:
            messages.put(line)
    except ValueError:
        pass  # closed while it was read
    messages.put(None)
