# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The task of a benchmark: one method registers pairs of one recording, on a worker."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any

import cv2

from aick_ros.errors import InputError
from aick_ros.evaluation.baselines import Baseline
from aick_ros.evaluation.baselines.registry import make
from aick_ros.evaluation.benchmark.journal import FrameLine, Journal, PairLine
from aick_ros.evaluation.benchmark.last_step import LastStep
from aick_ros.evaluation.benchmark.recording import Recording
from aick_ros.evaluation.scores.frame_pairs import FramePair
from aick_ros.frames.rgbd import RgbdFrame

_START_LIMIT = 120.0  # [s] for a large library to load; chosen

_BROKEN = object()  # in place of a frame that the method could not prepare


@dataclass(frozen=True, eq=False)
class Job:
    """
    One method on some pairs of one recording.

    :param identity: of the method.
    :param factory: of the method, called with the options.
    :param journal: path of the file that results are added to.
    :param last_step: path of a file of this job alone.
    :param time_limit: longest time for a frame or a pair [s].
    """

    identity: str
    factory: str
    options: Mapping[str, Any]
    recording: Recording
    pairs: Sequence[FramePair]
    journal: Path
    last_step: Path
    time_limit: float

    def failed(self, pair: FramePair, failure: str, milliseconds: float | None = None) -> PairLine:
        """Return the line of a pair that could not be registered."""
        return PairLine(self.identity, self.recording.name, pair, None, None, milliseconds,
                        failure)


def measure(job: Job) -> str:
    """
    Register the pairs that the journal does not have, and add them to it.

    If a process was lost with this job before, the step that it was in counts as failed.

    :returns: why the method does not start; '' where it does.
    """
    cv2.setNumThreads(1)
    journal = Journal(job.journal)
    with LastStep(job.last_step) as steps:
        done = journal.pairs.get((job.identity, job.recording.name), {})
        remaining = dict.fromkeys(pair for pair in job.pairs if pair not in done)
        if steps.loss is not None:
            if not steps.loss.frames:
                steps.keep_loss()
                return f'{steps.loss.reason} while it was loaded'
            for pair in [pair for pair in remaining if set(steps.loss.frames) <= set(pair)]:
                journal.add(job.failed(pair, steps.loss.reason))
                del remaining[pair]
        try:
            with steps.step(max(job.time_limit, _START_LIMIT)):
                method = make(job.factory, job.options)
        except (Exception, SystemExit) as error:
            return f'{type(error).__name__}: {error}'
        _Registration(job, method, steps, journal).run(remaining)
    return ''


class _Registration:
    """One method at work."""

    def __init__(self, job: Job, method: Baseline, steps: LastStep, journal: Journal) -> None:
        self._job, self._method, self._steps, self._journal = job, method, steps, journal

    def run(self, pairs: Iterable[FramePair]) -> None:
        """Prepare the frames of the pairs once each, as long as they are needed, and register."""
        by_source: dict[int, list[FramePair]] = {}
        last_use: dict[int, int] = {}
        for pair in sorted(pairs, key=lambda pair: pair.source):
            by_source.setdefault(pair.source, []).append(pair)
            last_use[pair.target] = last_use[pair.source] = pair.source
        prepared: dict[int, Any] = {}
        for index, frame in enumerate(self._frames()):
            if index not in last_use:
                continue
            prepared[index] = self._prepare(index, frame)
            for pair in by_source.get(index, ()):
                self._journal.add(self._register(pair, prepared[pair.source],
                                                 prepared[pair.target]))
            prepared = {i: content for i, content in prepared.items() if last_use[i] > index}

    def _frames(self) -> Iterator[RgbdFrame]:
        """Yield the frames whose stamps the pairs are of; others would be other pairs."""
        recording = self._job.recording
        frames = islice(recording.request.open().frames(_skip), recording.request.limit)
        for frame, stamp in zip_longest(frames, recording.stamps):
            if frame is None or frame.stamp != stamp:
                raise InputError(f'the frames of {recording.name} have changed since the start of '
                                 'the benchmark: restore them, and run it again')
            yield recording.shown(frame)

    def _prepare(self, index: int, frame: RgbdFrame) -> Any:
        job = self._job
        try:
            with self._steps.step(job.time_limit, [index]):
                start = time.perf_counter()
                content = self._method.prepare(frame)
                milliseconds = _since(start)
        except (Exception, SystemExit):
            return _BROKEN
        self._journal.add(FrameLine(job.identity, job.recording.name, index, milliseconds))
        return content

    def _register(self, pair: FramePair, source: Any, target: Any) -> PairLine:
        job, start = self._job, math.nan
        if source is _BROKEN or target is _BROKEN:
            return job.failed(pair, 'a frame could not be prepared')
        try:
            with self._steps.step(job.time_limit, pair):
                start = time.perf_counter()
                estimate = self._method.register(source, target)
                milliseconds = _since(start)
        except (Exception, SystemExit) as error:
            return job.failed(pair, f'raised {type(error).__name__}', _since(start))
        if estimate.T_target_source is None:
            return job.failed(pair, estimate.failure, milliseconds)
        translation, rotation = job.recording.error(pair, estimate.T_target_source)
        return PairLine(job.identity, job.recording.name, pair, translation, rotation,
                        milliseconds, '')


def _since(start: float) -> float:
    return 1e3 * (time.perf_counter() - start)


def _skip(error: InputError) -> None:
    """Ignore a damaged image: the scan of the recording has reported it."""
