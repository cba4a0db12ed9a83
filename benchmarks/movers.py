# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Errors of the odometry while objects move through the view, beside those of the last release.

    python benchmarks/movers.py [SEED...] [--runs N] [--json FILE] [--record RELEASE]

Boards, cartons, two people or a poster move before a camera at rest or in a hand, as in
``passing.py`` and ``moving_objects.py``, or nothing does. Each seed is a room. Each run has a
sensor noise of its own. Printed are the largest error of the pose, that at the end, the largest
one in standard deviations that the odometry reports, the false frames, whose motion is wrong by
more than a centimetre, and the frames that were lost: medians of the runs.

The figures are compared with those of the last release in ``movers_history.json``: what got worse
by more than its noise is named, and the exit code is 1. ``--record`` adds this run to the history;
three runs and more show what the noise is.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

if __name__ == '__main__':
    from one_thread import restart_in_one_thread
    restart_in_one_thread()

import cv2
import numpy as np
from markdown_page import table
from moving_objects import Scene
from passing import Errors, Passage, errors_of, measured
from release_history import (
    Figure, figures_of, last_release, record, release_line, summary, worse, write_json)

from aick_ros.evaluation.scores.machine import machine_facts

HISTORY = Path(__file__).with_name('movers_history.json')
SEEDS = 3, 5, 24
SPEED = 0.7  # m/s, of boards
BOARDS = {'board 1/3': 1 / 3, 'board 1/2': 1 / 2, 'board 2/3': 2 / 3}
"""Name -> share of the width of the view."""

CASES = [*((objects, 'at rest') for objects in (*BOARDS, 'cartons', 'two', 'poster', 'nothing')),
         *((objects, 'in a hand') for objects in ('board 1/2', 'poster', 'nothing'))]
"""What moves, and where the camera is."""

MEASURES = {'error [mm]': 10.0, 'false frames': 2.0, 'lost frames': 1.0}
"""Name -> the least noise, measured: sensor noise alone changes what is decided in a frame."""


class Case(NamedTuple):
    """A recording: what moves, where the camera is, and the seed of the room."""

    objects: str
    camera: str
    seed: int

    def recording(self) -> Passage | Scene:
        """Return it."""
        is_held = self.camera == 'in a hand'
        return (Passage(self.seed, BOARDS[self.objects], SPEED, is_held)
                if self.objects in BOARDS else Scene(self.objects, self.seed, is_held))

    def __str__(self) -> str:
        """Return its name."""
        return f'{self.objects}, camera {self.camera}, room {self.seed}'


Run = Mapping[Case, Errors]


def runs_in(seed: int, count: int) -> Sequence[Run]:
    """Return the errors of all cases in a room, run by run."""
    cv2.setNumThreads(1)
    runs: list[dict[Case, Errors]] = [{} for _ in range(count)]
    for objects, camera in CASES:
        case = Case(objects, camera, seed)
        recording = case.recording()
        pictures = [recording.picture(index) for index in range(recording.count)]
        for number, run in enumerate(runs):
            run[case] = errors_of(measured(pictures, [seed, number]), recording.poses)
    return runs


def figures(run: Run) -> dict[str, float]:
    """Return what is compared of a run."""
    found: dict[str, float] = {}
    for case, errors in run.items():
        values = errors.largest, errors.false, errors.lost
        found |= {f'{case}: {measure}': value for measure, value in zip(MEASURES, values)}
    return found


def noisy(found: Mapping[str, Figure]) -> dict[str, Figure]:
    """Return figures whose noise is at least that of their measure."""
    return {name: Figure(figure.value, max(figure.noise, MEASURES[name.rsplit(': ')[-1]]))
            for name, figure in found.items()}


def errors_table(runs: Sequence[Run], past: Mapping[str, Figure]) -> str:
    """Return a row for each case, with the error at the release that is compared with."""
    rows: list[Sequence[str]] = [
        ('objects', 'camera', 'room', 'largest [mm]', 'at the end [mm]', 'in sigma', 'false',
         'lost', 'release [mm]')]
    for case in runs[0]:
        values = np.median([(errors.largest, errors.last, errors.ratios.max(), errors.false,
                             errors.lost) for errors in (run[case] for run in runs)], axis=0)
        then = past.get(f'{case}: error [mm]')
        rows.append((case.objects, case.camera, str(case.seed),
                     *(f'{value:.1f}' for value in values[:3]),
                     *(f'{value:g}' for value in values[3:]),
                     '' if then is None else f'{then.value:.1f}'))
    return table(rows)


def report(runs: Sequence[Run], machine: Mapping[str, Any],
           then: Mapping[str, Any] | None) -> str:
    """Return the table, its medians, and the release that is compared with."""
    past = figures_of(then, 'errors')
    largest = [np.median([run[case].largest for run in runs]) for case in runs[0]]
    lines = [', '.join(f'{name} {value}' for name, value in machine.items()), '',
             errors_table(runs, past), '',
             f'largest errors: median {np.median(largest):.1f} mm, {max(largest):.1f} mm at most']
    if then is not None:
        lines.append(release_line(then, machine))
    return '\n'.join(lines)


def measure(seeds: Sequence[int], count: int) -> list[Run]:
    """Return the runs in some rooms, which have a process each, as many at a time as cores."""
    cores = int(machine_facts()['cores'])
    with ProcessPoolExecutor(min(cores, len(seeds))) as pool:
        rooms = list(pool.map(runs_in, seeds, len(seeds) * [count]))
    return [{case: errors for room in rooms for case, errors in room[number].items()}
            for number in range(count)]


def main() -> None:
    """Measure, print and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('seeds', type=int, nargs='*', metavar='SEED', default=SEEDS)
    parser.add_argument('--runs', type=int, default=1, help='their differences are the noise')
    parser.add_argument('--json', help='file for machine and errors, - for standard output')
    parser.add_argument('--record', metavar='RELEASE', help='add this run to the history')
    options = parser.parse_args()
    runs, machine = measure(options.seeds, options.runs), machine_facts()
    found = noisy(summary([figures(run) for run in runs]))
    then = last_release(json.loads(HISTORY.read_text()), str(machine['cpu']))
    print(report(runs, machine, then), file=sys.stderr if options.json == '-' else sys.stdout)
    if options.json:
        write_json(options.json, machine, 'errors', found)
    if options.record:
        record(HISTORY, options.record, machine, 'errors', found)
    sys.exit('\n'.join(worse(found, figures_of(then, 'errors'))) or 0)


if __name__ == '__main__':
    main()
