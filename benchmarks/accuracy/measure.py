# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Measures on a recording what docs/accuracy.md shows of this package itself.

    python benchmarks/accuracy/measure.py SOURCE JSON [JOBS]

JOBS parts run at a time, as many as there are cores. Each is in one thread: BLAS is held to it by
OPENBLAS_NUM_THREADS=1 and OMP_NUM_THREADS=1, with which this script restarts itself, OpenCV by
setNumThreads(1).
"""

from __future__ import annotations

import dataclasses
import datetime
import sys
from collections.abc import Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any

sys.path.append(str(Path(__file__).resolve().parents[1]))
from one_thread import restart_in_one_thread  # noqa: E402: found there

if __name__ == '__main__':
    restart_in_one_thread()

import cv2  # noqa: E402: only now do the libraries read how many threads they may have
from altered import Altered  # noqa: E402
from frame_time import frame_time  # noqa: E402
from growth import growth  # noqa: E402
from registered import Registered  # noqa: E402

from aick_ros.cli.output.files import write_json  # noqa: E402
from aick_ros.evaluation.scores.evaluation import evaluate  # noqa: E402
from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of  # noqa: E402
from aick_ros.evaluation.scores.machine import machine_facts  # noqa: E402
from aick_ros.evaluation.scores.trajectory_errors import compare  # noqa: E402
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore  # noqa: E402
from aick_ros.odometry import Odometry  # noqa: E402
from aick_ros.settings import Settings  # noqa: E402
from aick_ros.settings.parameter import with_values  # noqa: E402
from aick_ros.sources import RgbdSource, open_source, raise_damage  # noqa: E402

FRAMES = 150  # that everything but the growth over distance is measured on
GAPS = (1, 5, 10)
SKIPS = (2, 4, 8)
MODES = ('none', 'keypoints', 'joint')
DEFAULT = 'joint'
ONE_CLOCK = 'one-clock'
REFERENCES = ('previous',)  # beside the keyframe, which is the default
_KEPT = ('pairs', 'trajectory', 'consistency', 'silent_failures', 'keypoints_mean')


def measure(path: str, jobs: int | None = None) -> dict[str, Any]:
    """Return all figures of a recording, as JSON takes them."""
    frames = len(open_source(path))
    with ProcessPoolExecutor(jobs, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
        frame_times, registered = pool.submit(_timed, path), pool.submit(_registered, path)
        growths = {mode: pool.submit(_growth, path, mode) for mode in MODES}
        variants = {mode: pool.submit(_evaluated, path, mode) for mode in MODES}
        for reference in REFERENCES:
            variants[reference] = pool.submit(_evaluated, path, DEFAULT, reference=reference)
        if _has_two_clocks(path):
            variants[ONE_CLOCK] = pool.submit(_evaluated, path, DEFAULT, one_clock=True)
        skips = {str(skip): pool.submit(_skipped, path, skip) for skip in SKIPS}
        return {
            'date': datetime.date.today().isoformat(), 'machine': machine_facts(),
            'frames': min(frames, FRAMES), 'frames_of_growth': frames,
            'variants': _results(variants), 'skips': _results(skips), 'growth': _results(growths),
            **registered.result(), 'frame_time': frame_times.result()}


def _results(futures: Mapping[str, Future]) -> dict[str, Any]:
    return {name: future.result() for name, future in futures.items()}


def _has_two_clocks(path: str) -> bool:
    frame = next(open_source(path).frames(raise_damage))
    return frame.depth_stamp not in (None, frame.stamp)


def _with_mode(mode: str) -> Settings:
    return with_values(Settings(), {'refinement.mode': mode})


def _evaluated(path: str, mode: str, one_clock: bool = False,
               reference: str = 'keyframe') -> dict[str, Any]:
    """Return the figures of ``aick evaluate --json``, and the NEES of each increment."""
    source = Altered(open_source(path), FRAMES, one_clock=one_clock)
    settings = with_values(_with_mode(mode), {'odometry.reference': reference})
    evaluation = evaluate(source, settings, GAPS)
    figures = evaluation.to_json()
    return {**{key: figures[key] for key in _KEPT},
            'nees': [round(nees, 3) for nees in evaluation.nees['odometry']]}


def _run(source: RgbdSource, settings: Settings = Settings()) -> list[FrameRecord]:
    odometry = Odometry(settings)
    return [FrameRecord.of(odometry.register_frame(frame))
            for frame in source.frames(raise_damage)]


def _skipped(path: str, skip: int) -> dict[str, Any]:
    source = Altered(open_source(path), FRAMES, skip)
    records = _run(source)
    score = TrajectoryScore.of(records, source.ground_truth)
    return {'frames': len(records), **dataclasses.asdict(score)}


def _growth(path: str, mode: str) -> dict[str, dict[str, float]]:
    source = open_source(path)
    return growth(compare(trajectory_of(_run(source, _with_mode(mode))), source.ground_truth))


def _registered(path: str) -> dict[str, Any]:
    registered = Registered.of(Altered(open_source(path), FRAMES))
    return {'shifted_truth': registered.shifted(), 'loops': registered.loops(),
            'stamps': registered.stamps()}


def _timed(path: str) -> dict[str, Any]:
    return frame_time(Altered(open_source(path), FRAMES))


def main() -> None:
    """Measure one recording."""
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    path, target, *jobs = sys.argv[1:]
    figures = measure(path, int(jobs[0]) if jobs else None)
    write_json(target, figures)


if __name__ == '__main__':
    main()
