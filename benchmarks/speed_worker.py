# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
One way to register frames, in a process of its own that :mod:`speed` starts.

    python benchmarks/speed_worker.py NAME SOURCE [--imu]

It reads lines from standard input: ``time`` registers the next frame and answers with a line of
JSON, the milliseconds of processor time of each stage; ``skip`` only reads it. At the end it
answers with the peak of its memory. NAME is ``default``, a preset, or a method of ``aick
benchmark``, which registers each frame to the one before. Reading frames is not timed, nor is the
undistortion that some methods need. All take images alone, unless ``--imu`` is given.
"""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from collections.abc import Callable, Mapping
from typing import Protocol, TypeVar

import cv2

from aick_ros.borders.allocator import keep_freed_memory
from aick_ros.evaluation.baselines.registry import METHODS, make
from aick_ros.evaluation.scores.machine import peak_memory_mb
from aick_ros.frames.rectification import rectified
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.odometry import Odometry
from aick_ros.registration import stage_times
from aick_ros.settings import Settings
from aick_ros.settings.presets import preset
from aick_ros.sources import open_source, raise_damage

_Result = TypeVar('_Result')


class Contestant(Protocol):
    """A way to register a stream of frames."""

    def skip(self, frame: RgbdFrame) -> None:
        """Take a frame that is not timed."""

    def timed(self, frame: RgbdFrame) -> Mapping[str, float]:
        """Register a frame; return the processor time of each stage and ``total`` [ms]."""


class Stream:
    """Odometry with the defaults or a preset; it needs every frame."""

    def __init__(self, name: str) -> None:
        self._odometry = Odometry(Settings() if name == 'default' else preset(name))

    def skip(self, frame: RgbdFrame) -> None:
        """Register the frame all the same."""
        self._odometry.register_frame(frame)

    def timed(self, frame: RgbdFrame) -> Mapping[str, float]:
        """Register a frame to the keyframe."""
        update, total = _processor_ms(lambda: self._odometry.register_frame(frame))
        return {**update.timing, 'total': total}


class Pairwise:
    """A method that registers two frames."""

    def __init__(self, name: str) -> None:
        self._method = make(METHODS[name].factory, METHODS[name].options)
        self._undistorts = name.startswith('opencv')
        self._before: RgbdFrame | None = None

    def skip(self, frame: RgbdFrame) -> None:
        """Keep the frame."""
        self._before = frame

    def timed(self, frame: RgbdFrame) -> Mapping[str, float]:
        """Prepare a frame and register it to the one before."""
        before, self._before = self._ready(self._before or frame), frame
        target, frame = self._method.prepare(before), self._ready(frame)
        source, prepare = _processor_ms(lambda: self._method.prepare(frame))
        _, register = _processor_ms(lambda: self._method.register(source, target))
        return {'prepare': prepare, 'register': register, 'total': prepare + register}

    def _ready(self, frame: RgbdFrame) -> RgbdFrame:
        return rectified(frame) if self._undistorts else frame


def _processor_ms(work: Callable[[], _Result]) -> tuple[_Result, float]:
    start = time.process_time()
    result = work()
    return result, 1e3 * (time.process_time() - start)


def main() -> None:
    """Answer line by line."""
    name, source, *options = sys.argv[1:]
    cv2.setNumThreads(1)
    keep_freed_memory()  # as the programs do; all contestants alike
    stage_times.clock = time.process_time
    contestant: Contestant = Pairwise(name) if name in METHODS else Stream(name)
    frames = open_source(source).frames(raise_damage)
    for line in sys.stdin:
        frame = next(frames)
        if '--imu' not in options:
            frame = dataclasses.replace(frame, imu=None)
        if line.strip() == 'time':
            print(json.dumps(contestant.timed(frame)), flush=True)
        else:
            contestant.skip(frame)
    print(json.dumps({'peak_mb': peak_memory_mb()}))


if __name__ == '__main__':
    main()
