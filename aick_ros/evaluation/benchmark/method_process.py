# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The process in which one method registers the pairs of one recording.

It reads one job as a line of JSON from standard input and answers with lines of JSON. It announces
each step, so that the supervisor knows the step of a crash. The output of the method itself goes
to standard error.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterable
from itertools import islice
from typing import Any, TextIO

import cv2

from aick_ros.borders.parent import end_with_parent
from aick_ros.errors import InputError
from aick_ros.evaluation.baselines import Baseline
from aick_ros.evaluation.baselines.registry import make
from aick_ros.evaluation.benchmark.recording import Request
from aick_ros.evaluation.scores.frame_pairs import FramePair
from aick_ros.frames.rgbd import RgbdFrame

Report = Callable[..., None]

_BROKEN = object()  # in place of a frame that the method could not prepare


def main() -> None:
    """Run the job that is read from standard input."""
    end_with_parent()
    report = _writer(_reserve_standard_output())
    job = json.loads(sys.stdin.readline())
    cv2.setNumThreads(1)
    try:
        method = make(job['factory'], job['options'])
    except Exception as error:
        report(unusable=f'{type(error).__name__}: {error}')
        return
    report(ready=True)
    request = Request(**job['request'])
    frames = islice(request.open().frames(_skip), request.limit)
    register_pairs(method, frames, [FramePair(*pair) for pair in job['pairs']], report)
    report(end=True)


def register_pairs(method: Baseline, frames: Iterable[RgbdFrame], pairs: Iterable[FramePair],
                   report: Report) -> None:
    """
    Prepare the frames of the pairs once each, register the pairs, and report the results.

    Only frames that later pairs need are kept.
    """
    by_source: dict[int, list[FramePair]] = {}
    last_use: dict[int, int] = {}
    for pair in sorted(pairs, key=lambda pair: pair.source):
        by_source.setdefault(pair.source, []).append(pair)
        last_use[pair.target] = last_use[pair.source] = pair.source
    prepared: dict[int, Any] = {}
    for index, frame in enumerate(frames):
        if index not in last_use:
            continue
        prepared[index] = _prepare(method, index, frame, report)
        for pair in by_source.get(index, ()):
            _register(method, pair, prepared[pair.source], prepared[pair.target], report)
        prepared = {i: content for i, content in prepared.items() if last_use[i] > index}


def _prepare(method: Baseline, index: int, frame: RgbdFrame, report: Report) -> Any:
    report(step='frame', frame=index)
    start = time.perf_counter()
    try:
        content = method.prepare(frame)
    except Exception as error:
        print(f'frame {index}: {type(error).__name__}: {error}', file=sys.stderr)
        return _BROKEN
    report(frame=index, ms=1e3 * (time.perf_counter() - start))
    return content


def _register(method: Baseline, pair: FramePair, source: Any, target: Any, report: Report) -> None:
    if source is _BROKEN or target is _BROKEN:
        report(pair=pair, ms=None, T_target_source=None, failure='a frame could not be prepared')
        return
    report(step='pair', pair=pair)
    start = time.perf_counter()
    try:
        estimate = method.register(source, target)
    except Exception as error:
        print(f'pair {pair}: {type(error).__name__}: {error}', file=sys.stderr)
        report(pair=pair, ms=1e3 * (time.perf_counter() - start), T_target_source=None,
               failure=f'raised {type(error).__name__}')
        return
    milliseconds, T_target_source = 1e3 * (time.perf_counter() - start), estimate.T_target_source
    report(pair=pair, ms=milliseconds, failure=estimate.failure,
           T_target_source=None if T_target_source is None else T_target_source.tolist())


def _reserve_standard_output() -> TextIO:
    """Return standard output, and redirect everything printed to standard error."""
    answers = os.fdopen(os.dup(1), 'w', encoding='utf-8')
    os.dup2(2, 1)
    return answers


def _writer(stream: TextIO) -> Report:
    def report(**message: Any) -> None:
        stream.write(json.dumps(message) + '\n')
        stream.flush()
    return report


def _skip(error: InputError) -> None:
    """Ignore a damaged image: the scan of the recording has reported it."""


if __name__ == '__main__':
    main()
