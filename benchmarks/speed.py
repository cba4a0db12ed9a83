# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Processor time of a frame beside other methods, as ratios from one run.

    python benchmarks/speed.py [SOURCE...] [--json FILE] [--record RELEASE]

Each contestant is a process of its own with one thread. They take the same frames in turn, one
frame at a time, so that a machine whose speed drifts slows all of them alike. The methods that
register two frames are timed on each fifth one. All take images alone, as not all can use an IMU;
with ``--imu`` the odometry has the samples of one that the recordings have. Without a SOURCE the
recordings in AICK_DATA are used, or a rendered one. Last comes the node, over DDS with a camera of
30 Hz (``--node 0``: not).

The ratios are compared with those of the last release in ``speed_history.json``: what got worse by
more than its noise is named, and the exit code is 1. ``--record`` adds this run to the history.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from markdown_page import table
from release_history import (
    Figure, figures_of, last_release, record, release_line, summary, worse, write_json)
from speed_ratios import LARGER_IS_BETTER, ratios

from aick_ros.borders.threads import ONE_THREAD
from aick_ros.evaluation.baselines.registry import METHODS
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.registration.stage_times import STAGES
from aick_ros.settings.presets import PRESETS

HISTORY = Path(__file__).with_name('speed_history.json')
RECORDINGS = 'freiburg1_xyz_150', 'freiburg1_rpy_100'
STREAMS = 'default', *(name for name in ('embedded', 'paper-fast') if name in PRESETS)
PAIRWISE = ('opencv-depth', 'opencv-rgbd', 'small-gicp', 'pnp', 'aick-orb-fast', 'aick-orb-350',
            'aick-orb')
COLUMNS = ('total', *STAGES, 'prepare', 'register')
EVERY = 5  # frames, of which one is timed of the methods that register two
WARM_UP = 5  # frames, not counted


class Worker:
    """A contestant in a process of its own, see :mod:`speed_worker`."""

    def __init__(self, name: str, source: str, has_imu: bool) -> None:
        self.name = name
        self._every = 1 if name in STREAMS else EVERY
        script = Path(__file__).with_name('speed_worker.py')
        self._process = subprocess.Popen(
            [sys.executable, script, name, source, *['--imu'] * has_imu],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
            env={**os.environ, **ONE_THREAD})

    def frame(self, index: int) -> Mapping[str, float]:
        """Take the next frame; return the times of its stages, none where it is not timed."""
        is_timed = index % self._every == 0
        self._tell('time' if is_timed else 'skip')
        times = self._answer() if is_timed else {}
        return times if index >= WARM_UP else {}

    def finish(self) -> float:
        """End the process; return the peak of its memory [MB]."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        peak = self._answer()['peak_mb']
        self._process.wait()
        return peak

    def _tell(self, word: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f'{word}\n')
        self._process.stdin.flush()

    def _answer(self) -> dict[str, float]:
        assert self._process.stdout is not None
        answer: dict[str, float] = json.loads(self._process.stdout.readline())
        return answer


@dataclasses.dataclass
class Measured:
    """Costs of contestants: milliseconds of each frame by stage, and the peak of memory [MB]."""

    times: dict[str, dict[str, list[float]]] = dataclasses.field(default_factory=dict)
    peaks: dict[str, float] = dataclasses.field(default_factory=dict)

    def add(self, name: str, times: Mapping[str, float]) -> None:
        """Add a frame."""
        stages = self.times.setdefault(name, {})
        for stage, milliseconds in times.items():
            stages.setdefault(stage, []).append(milliseconds)


def measure(names: Sequence[str], source: str, frames: int, has_imu: bool,
            measured: Measured) -> None:
    """Let contestants take the frames of a source in turn, another one first each time."""
    workers = [Worker(name, source, has_imu) for name in names]
    for index in range(frames):
        first = index % len(workers)
        for worker in (*workers[first:], *workers[:first]):
            measured.add(worker.name, worker.frame(index))
    for worker in workers:
        measured.peaks[worker.name] = max(
            worker.finish(), measured.peaks.get(worker.name, 0.0))


def node_ratios(seconds: float) -> dict[str, float]:
    """Return what the node shows from outside at 640x480 and 30 Hz."""
    from node import Plan, live

    from aick_ros.ros.process.resources import use_fastdds_profile
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    use_fastdds_profile()
    with tempfile.TemporaryDirectory() as folder:
        lost, median, slow, cores = (
            row.measured for row in live(Plan(Path(folder), seconds, 0.0, 0)))
    return {'node_lost': lost / (30 * seconds), 'node_delay_p99_by_median': slow / median,
            'node_cores_at_30_hz': cores}


def contestants() -> tuple[list[str], list[str]]:
    """Return the contestants, and a sentence for each that is missing here."""
    missing = {name: METHODS[name].missing for name in PAIRWISE if METHODS[name].missing}
    return ([*STREAMS, *(name for name in PAIRWISE if name not in missing)],
            [f'{name} is missing: {install}' for name, install in missing.items()])


def sources() -> list[str]:
    """Return the recordings at hand, or a rendered one."""
    folder = Path(os.environ.get('AICK_DATA', ''))
    return [str(folder / name) for name in RECORDINGS
            if (folder / name).is_dir()] or ['synthetic:1']


def times_table(measured: Measured) -> str:
    """Return median and 99th percentile of each stage, and the peak of memory."""
    rows = [('milliseconds, median (99 %)', *COLUMNS, 'memory [MB]')]
    for name, stages in measured.times.items():
        cells = (_cell(stages[column]) if column in stages else '' for column in COLUMNS)
        rows.append((name, *cells, f'{measured.peaks[name]:.0f}'))
    return table(rows)


def _cell(milliseconds: Iterable[float]) -> str:
    median, slow = np.percentile(list(milliseconds), (50, 99))
    return f'{median:.2f} ({slow:.2f})'


def report(measured: Measured, found: Mapping[str, Figure], machine: Mapping[str, Any],
           then: Mapping[str, Any] | None) -> str:
    """Return the tables, and the release that is compared with."""
    past = figures_of(then, 'ratios')
    rows = [('ratio', 'now', 'noise', 'release')]
    rows += [(name, f'{ratio.value:.3g}', f'{ratio.noise:.2g}',
              f'{past[name].value:.3g}' if name in past else '')
             for name, ratio in found.items()]
    lines = [', '.join(f'{name} {value}' for name, value in machine.items()), '',
             times_table(measured), '', table(rows)]
    if then is not None:
        lines.append(f'\n{release_line(then, machine)}')
    return '\n'.join(lines)


def main() -> None:
    """Measure, print and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('sources', nargs='*', metavar='SOURCE')
    parser.add_argument('--frames', type=int, default=100, help='of each source')
    parser.add_argument('--runs', type=int, default=3, help='their differences are the noise')
    parser.add_argument('--imu', action='store_true', help='samples of an IMU for the odometry')
    parser.add_argument('--node', type=float, default=20.0, help='seconds; 0: without the node')
    parser.add_argument('--json', help='file for machine and ratios, - for standard output')
    parser.add_argument('--record', metavar='RELEASE', help='add this run to the history')
    options = parser.parse_args()
    names, missing = contestants()
    for line in missing:
        print(line, file=sys.stderr)
    measured, runs = Measured(), []
    for _ in range(options.runs):
        run = Measured()
        for source in options.sources or sources():
            measure(names, source, options.frames, options.imu, run)
        runs.append({**ratios(run.times), **(node_ratios(options.node) if options.node else {})})
        measured = run
    found, machine = summary(runs), machine_facts()
    then = last_release(json.loads(HISTORY.read_text()), str(machine['cpu']))
    print(report(measured, found, machine, then),
          file=sys.stderr if options.json == '-' else sys.stdout)
    if options.json:
        write_json(options.json, machine, 'ratios', found)
    if options.record:
        record(HISTORY, options.record, machine, 'ratios', found)
    sys.exit('\n'.join(worse(found, figures_of(then, 'ratios'), LARGER_IS_BETTER)) or 0)


if __name__ == '__main__':
    main()
