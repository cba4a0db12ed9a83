# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs one method on one recording in its own process, through crashes and hangs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aick_ros.evaluation.baselines.registry import Method
from aick_ros.evaluation.benchmark.journal import FrameLine, Line, PairLine
from aick_ros.evaluation.benchmark.json_process import JsonProcess
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.scores.frame_pairs import FramePair

_MODULE = 'aick_ros.evaluation.benchmark.method_process'
_MAX_LOSSES = 3  # crashes and hangs after which the remaining pairs count as failed; chosen
_START_LIMIT = 120.0  # [s] for a large library to load; chosen
_READ_LIMIT = 120.0  # [s] from one frame to the next; chosen


class UnusableMethodError(Exception):
    """A method that is installed but does not start."""


@dataclass(frozen=True)
class Job:
    """One method on some pairs of one recording."""

    method: Method
    recording: Recording
    pairs: Sequence[FramePair]


class _LostError(Exception):
    """The process crashed or hangs; the message is the failure of the step it was in."""


def supervise(job: Job, time_limit: float, record: Callable[[Line], None],
              is_stopped: Callable[[], bool]) -> None:
    """
    Run a job, in a new process after each crash or hang; the step that caused it counts as failed.

    :param time_limit: longest time for a frame or a pair [s].
    :param record: called with each measured frame and pair, from this thread.
    :param is_stopped: called several times a second.
    :raises UnusableMethodError: where the method does not start.
    """
    remaining = dict.fromkeys(job.pairs)
    for _ in range(_MAX_LOSSES):
        attempt = _Attempt(job, list(remaining), time_limit, is_stopped)
        try:
            for line in attempt.lines():
                if isinstance(line, PairLine):
                    del remaining[line.pair]
                record(line)
            return
        except _LostError as loss:
            for pair in attempt.lost_pairs(remaining):
                del remaining[pair]
                record(_failed(job, pair, str(loss)))
    for pair in remaining:
        record(_failed(job, pair, f'given up after {_MAX_LOSSES} crashes or hangs'))


class _Attempt:
    """One process, and the step that it is in."""

    def __init__(self, job: Job, pairs: Sequence[FramePair], time_limit: float,
                 is_stopped: Callable[[], bool]) -> None:
        self._job, self._pairs = job, pairs
        self._time_limit, self._is_stopped = time_limit, is_stopped
        self._step: dict[str, Any] = {}
        self._is_ready = False

    def lines(self) -> Iterator[Line]:
        """Yield what the process measures, until it ends or is stopped."""
        method = self._job.method
        request = {'factory': method.factory, 'options': dict(method.options),
                   'request': self._job.recording.request.to_json(), 'pairs': self._pairs}
        with JsonProcess(_MODULE, request) as process:
            while (message := self._next(process)) is not None and 'end' not in message:
                if 'unusable' in message:
                    raise UnusableMethodError(message['unusable'])
                self._is_ready = True
                self._step = message if 'step' in message else {}
                if 'ms' in message:
                    yield self._line(message)

    def lost_pairs(self, remaining: Collection[FramePair]) -> list[FramePair]:
        """Return the pairs that fail because of the step in which the process was lost."""
        if 'pair' in self._step:
            return [FramePair(*self._step['pair'])]
        if 'frame' in self._step:
            return [pair for pair in remaining if self._step['frame'] in pair]
        return list(remaining)

    def _next(self, process: JsonProcess) -> dict[str, Any] | None:
        """Return the next message, None where the user stops."""
        limit = _START_LIMIT
        if self._is_ready:
            limit = self._time_limit if self._step else max(_READ_LIMIT, self._time_limit)
        try:
            message = process.next(limit, self._is_stopped)
        except TimeoutError as error:
            raise self._lost(str(error)) from None
        if message is None and not self._is_stopped():
            raise self._lost(f'crashed ({process.cause_of_exit()})')
        return message

    def _lost(self, failure: str) -> Exception:
        if not self._is_ready:
            return UnusableMethodError(f'{failure} while it was loaded')
        if not self._step:
            failure = f'{failure} between two frames'
        return _LostError(failure)

    def _line(self, message: dict[str, Any]) -> Line:
        job = self._job
        if 'frame' in message:
            return FrameLine(job.method.identity, job.recording.name, message['frame'],
                             message['ms'])
        pair, pose = FramePair(*message['pair']), message['T_target_source']
        if pose is None:
            return _failed(job, pair, message['failure'], message['ms'])
        translation, rotation = job.recording.error(pair, np.array(pose))
        return PairLine(job.method.identity, job.recording.name, pair, translation, rotation,
                        message['ms'], '')


def _failed(job: Job, pair: FramePair, failure: str,
            milliseconds: float | None = None) -> PairLine:
    return PairLine(job.method.identity, job.recording.name, pair, None, None, milliseconds,
                    failure)
