# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Cameras drawn at random: how many are lost, and whether their covariances are right.

    python benchmarks/random_cameras.py [--frames N] FIRST [LAST]

The number of a camera draws its resolution, field of view, rate, kind of depth noise and speed,
the room, and the flaws that it has: a rolling shutter, a delay, a wrong registration of depth to
colour, a lens, a scale, jitter and latency of its stamps, images that are repeated or missing,
holes, and a short range. Printed are the frames that were lost, those in which keypoints seem to
move by themselves, which none do in a static scene, the root mean square of the error of the
positions, the mean NEES of the increments, which is 6 where their covariance is right, and the
share of them inside their 95 % ellipsoid.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from typing import NamedTuple

if __name__ == '__main__':
    from one_thread import restart_in_one_thread
    restart_in_one_thread()

import numpy as np
from flawed_camera import FlawedCamera, Flaws
from run_scores import RunScores
from weights import SENSORS

from aick_ros.geometry.camera import Camera

FRAMES = 80
SIZES = (640, 480), (640, 360), (424, 240), (320, 240), (320, 180), (848, 480)
FIELD_OF_VIEW = 50.0, 95.0  # deg, across
RATES = 10.0, 15.0, 30.0, 60.0  # Hz
SPEED = 0.5, 3.0  # by that of a careful hand
CONSISTENT = 2.0, 7.5  # mean NEES; chosen: down to a standard deviation 1.7 times too large
HEAD = ('| camera | kind | flaws | lost | with objects | ATE [mm] | mean NEES | inside 95 % |\n'
        '|---|---|---|---|---|---|---|---|')


class Drawn(NamedTuple):
    """A camera that was drawn, and in words what it is and which flaws it has."""

    camera: FlawedCamera
    kind: str
    flaws: str

    @classmethod
    def of(cls, number: int, frames: int) -> Drawn:
        """Return the camera of a number."""
        rng = np.random.default_rng([number, 1])
        width, height = SIZES[rng.integers(len(SIZES))]
        view, rate = rng.uniform(*FIELD_OF_VIEW), float(rng.choice(RATES))
        focal = width / 2 / np.tan(np.radians(view / 2))
        kind = str(rng.choice(list(SENSORS)))
        speed = float(np.exp(rng.uniform(*np.log(SPEED))))
        flaws = Flaws.drawn(rng, rate)
        camera = Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)
        return cls(FlawedCamera(number, frames, camera, rate, kind, speed, flaws),
                   f'{width}x{height}, {view:.0f} deg, {rate:.0f} Hz, {kind}, x{speed:.1f}',
                   str(flaws))


def is_consistent(scores: RunScores) -> bool:
    """Return whether the mean NEES is what a right covariance gives, or somewhat less."""
    low, high = CONSISTENT
    return low <= (scores.consistency.nees_mean or 0.0) <= high


def cells(scores: RunScores) -> str:
    """Return the cells of a row."""
    return (f'{scores.lost} | {scores.with_objects} | {1e3 * scores.ate:.1f} | '
            f'{scores.consistency.nees_mean or 0.0:.1f} | '
            f'{scores.consistency.inside_95 or 0.0:.2f}')


def summary(found: Mapping[int, RunScores]) -> Iterator[str]:
    """Yield how many cameras have what they should, and the numbers of the others."""
    low, high = CONSISTENT
    for name, numbers in (
            ('no frame lost', [n for n, each in found.items() if each.lost]),
            ('no objects', [n for n, each in found.items() if each.with_objects]),
            (f'mean NEES of {low:g} to {high:g}', [
                n for n, each in found.items() if not is_consistent(each)])):
        others = f'; not {", ".join(map(str, numbers))}' if numbers else ''
        yield f'{name}: {len(found) - len(numbers)} of {len(found)}{others}'
    median = np.median([each.consistency.nees_mean or 0.0 for each in found.values()])
    yield f'median of the mean NEES: {median:.1f}'


def main() -> None:
    """Print the table, and what is to be looked at."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('first', type=int, metavar='FIRST')
    parser.add_argument('last', type=int, nargs='?', metavar='LAST')
    parser.add_argument('--frames', type=int, default=FRAMES, help='of each camera')
    options = parser.parse_args()
    print(HEAD)
    found = {}
    for number in range(options.first, (options.last or options.first) + 1):
        drawn = Drawn.of(number, options.frames)
        found[number] = RunScores.of(*drawn.camera.recording())
        print(f'| {number} | {drawn.kind} | {drawn.flaws} | {cells(found[number])} |', flush=True)
    for line in summary(found):
        print(f'\n{line}')


if __name__ == '__main__':
    main()
