# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
How much of a recording's scores is chance: the same frames with other noise of their images.

    python benchmarks/noise_draws.py [--draws N] FOLDER [FOLDER...]

A FOLDER is a recording with ground truth. Its first draw is as recorded. In each other one every
channel of every pixel of the colour images is a grey level darker, the same, or a grey level
brighter, at random by the number of the draw. Printed are the root mean squares of the errors of
the positions (ATE) and of the motions over a second (RPE), the mean NEES of the increments, which
is 6 where their covariance is right, and the share of them inside their 95 % ellipsoid. Last come
the mean and the standard deviation of the draws: a difference of one run below the latter shows
nothing.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

if __name__ == '__main__':
    from one_thread import restart_in_one_thread
    restart_in_one_thread()

import cv2
import numpy as np
from run_scores import RunScores
from weights import frames_of

from aick_ros.evaluation.scores.statistics import root_mean_square
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory

DRAWS = 8
LEAST_DRAWS = 2  # by definition: of one there is no standard deviation
LEVEL = 1  # largest noise of an image, in grey levels
HEAD = ('| recording | draw | ATE [mm] | RPE 1 s [mm] | RPE 1 s [deg] | mean NEES | inside 95 % |'
        '\n|---|---|---|---|---|---|---|')


class Scores(NamedTuple):
    """Scores of one draw, or what is common to all of them; NaN where there is none."""

    ate: float  # mm
    translation: float  # mm
    rotation: float  # deg
    nees: float
    inside: float

    @classmethod
    def of(cls, frames: Iterator[RgbdFrame], truth: Trajectory) -> Scores:
        """Return the scores of the odometry over frames."""
        found = RunScores.of(frames, truth)
        translations, rotations = found.trajectory.relative()
        values = (found.ate, root_mean_square(translations), root_mean_square(rotations),
                  found.consistency.nees_mean, found.consistency.inside_95)
        ate, translation, rotation, nees, inside = (
            np.nan if value is None else value for value in values)
        return cls(1e3 * ate, 1e3 * translation, float(np.degrees(rotation)), nees, inside)

    def __str__(self) -> str:
        """Return the cells of a row."""
        return (f'{self.ate:.1f} | {self.translation:.1f} | {self.rotation:.2f} | '
                f'{self.nees:.2f} | {self.inside:.3f}')


def drawn(frames: Sequence[RgbdFrame], number: int) -> Iterator[RgbdFrame]:
    """Yield the frames of a draw; those of the first one, 0, are the frames themselves."""
    rng = np.random.default_rng(number)
    for frame in frames:
        yield frame if number == 0 else dataclasses.replace(
            frame, colour=with_noise(frame.colour, rng))


def with_noise(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return an image, uint8, with uniform noise of whole grey levels."""
    noise = rng.integers(-LEVEL, LEVEL, image.shape, np.int16, endpoint=True)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


def summary(found: Sequence[Scores]) -> dict[str, Scores]:
    """Return the mean and the standard deviation of the scores of draws, by their names."""
    return {'mean': Scores(*np.mean(found, axis=0)),
            'standard deviation': Scores(*np.std(found, axis=0, ddof=1))}


def rows(folder: str, draws: int) -> Iterator[str]:
    """Yield the rows of a recording."""
    frames, truth = frames_of(folder, sys.maxsize)
    name, found = Path(folder).name, list[Scores]()
    for number in range(draws):
        found.append(Scores.of(drawn(frames, number), truth))
        yield f'| {name} | {number or "as recorded"} | {found[-1]} |'
    for statistic, scores in summary(found).items():
        yield f'| {name} | {statistic} | {scores} |'


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n\n')[0])
    parser.add_argument('folders', nargs='+', metavar='FOLDER')
    parser.add_argument('--draws', type=int, default=DRAWS, help='of each recording')
    options = parser.parse_args()
    if options.draws < LEAST_DRAWS:
        parser.error(f'--draws {options.draws}: at least {LEAST_DRAWS} are required')
    cv2.setNumThreads(1)
    print(HEAD)
    for folder in options.folders:
        for row in rows(folder, options.draws):
            print(row, flush=True)


if __name__ == '__main__':
    main()
