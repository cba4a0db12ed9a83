# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The process in which one method registers the pairs of one recording.

It takes one job as a line of JSON on standard input and answers with lines of JSON. Before each
step it says which, so that who watches knows what it died of. What the method itself prints goes
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

from aick_ros.errors import InputError
from aick_ros.evaluation.baselines import Baseline
from aick_ros.evaluation.baselines.registry import make
from aick_ros.evaluation.benchmark.recording import Request
from aick_ros.evaluation.scores.frame_pairs import FramePair
from aick_ros.frames.rgbd import RgbdFrame

Say = Callable[..., None]

_BROKEN = object()  # stands for a frame that the method could not prepare


def main() -> None:
    """Do the job that comes on standard input."""
    say = _speak_on(_take_standard_output())
    job = json.loads(sys.stdin.readline())
    cv2.setNumThreads(1)
    try:
        method = make(job['factory'], job['options'])
    except Exception as error:
        say(unusable=f'{type(error).__name__}: {error}')
        return
    say(ready=True)
    request = Request(**job['request'])
    frames = islice(request.open().frames(_skip), request.limit)
    register_pairs(method, frames, [FramePair(*pair) for pair in job['pairs']], say)
    say(end=True)


def register_pairs(method: Baseline, frames: Iterable[RgbdFrame], pairs: Iterable[FramePair],
                   say: Say) -> None:
    """
    Prepare the frames of the pairs once each, register the pairs, and say what came of it.

    Only the frames that are still needed are kept.
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
        prepared[index] = _prepare(method, index, frame, say)
        for pair in by_source.get(index, ()):
            _register(method, pair, prepared[pair.source], prepared[pair.target], say)
        prepared = {i: content for i, content in prepared.items() if last_use[i] > index}


def _prepare(method: Baseline, index: int, frame: RgbdFrame, say: Say) -> Any:
    say(step='frame', frame=index)
    start = time.perf_counter()
    try:
        content = method.prepare(frame)
    except Exception as error:
        print(f'frame {index}: {type(error).__name__}: {error}', file=sys.stderr)
        return _BROKEN
    say(frame=index, ms=1e3 * (time.perf_counter() - start))
    return content


def _register(method: Baseline, pair: FramePair, source: Any, target: Any, say: Say) -> None:
    if source is _BROKEN or target is _BROKEN:
        say(pair=pair, ms=None, T_target_source=None, failure='a frame could not be prepared')
        return
    say(step='pair', pair=pair)
    start = time.perf_counter()
    try:
        estimate = method.register(source, target)
    except Exception as error:
        print(f'pair {pair}: {type(error).__name__}: {error}', file=sys.stderr)
        say(pair=pair, ms=1e3 * (time.perf_counter() - start), T_target_source=None,
            failure=f'raised {type(error).__name__}')
        return
    milliseconds, T_target_source = 1e3 * (time.perf_counter() - start), estimate.T_target_source
    say(pair=pair, ms=milliseconds, failure=estimate.failure,
        T_target_source=None if T_target_source is None else T_target_source.tolist())


def _take_standard_output() -> TextIO:
    """Return what was standard output, and let all that is printed go to standard error."""
    answers = os.fdopen(os.dup(1), 'w', encoding='utf-8')
    os.dup2(2, 1)
    return answers


def _speak_on(stream: TextIO) -> Say:
    def say(**message: Any) -> None:
        stream.write(json.dumps(message) + '\n')
        stream.flush()
    return say


def _skip(error: InputError) -> None:
    """Take no notice: who looked through the recording has told of it."""


if __name__ == '__main__':
    main()
