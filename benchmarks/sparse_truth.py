# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Error of interpolating a sparse ground truth: a dense one with poses dropped, against itself.

    python benchmarks/sparse_truth.py RECORDING...

A RECORDING has a dense ground truth. Printed are the root mean squares, and the largest errors,
of the poses at its images: interpolated over some interval, and taken from a pose at a distance.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.sources import open_source

INTERVALS = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5)
"""Between the poses that are kept [s]."""

DISTANCES = (0.002, 0.005, 0.01)
"""From an image to the pose that is taken for it [s]."""

_PHASES = 5  # chosen: beginnings of the poses that are kept


def thinned(truth: Trajectory, interval: float) -> Iterator[Trajectory]:
    """Yield what remains of a ground truth with one pose in an interval [s]."""
    step = max(1, round(interval / truth.median_interval))
    for first in np.unique(np.linspace(0, step - 1, _PHASES, dtype=int)):
        yield Trajectory(truth.stamps[first::step], truth.poses[first::step])


def errors(truth: Trajectory, sparse: Trajectory, stamps: Iterable[int],
           shift: float = 0.0) -> Iterator[np.ndarray]:
    """Yield the errors of poses at stamps [ns], shifted by a time [s]: x y z rx ry rz [m, rad]."""
    for stamp in stamps:
        true = truth.at(stamp)
        pose = sparse.at(stamp + round(shift * NANOSECONDS))
        if true is not None and pose is not None:
            yield se3.difference(pose, true)


def row(recording: str, how: str, found: Iterable[np.ndarray]) -> str:
    """Return a row of the table."""
    errors_of_all = np.array(list(found))
    distances = 1e3 * np.linalg.norm(errors_of_all[:, :3], axis=1)
    angles = np.degrees(np.linalg.norm(errors_of_all[:, 3:], axis=1))
    return (f'| {recording} | {how} | {np.sqrt(np.mean(distances ** 2)):.2f} | '
            f'{distances.max():.2f} | {np.sqrt(np.mean(angles ** 2)):.2f} | {angles.max():.2f} |')


def rows(recording: str) -> Iterator[str]:
    """Yield the rows of a recording."""
    source = open_source(recording)
    truth = source.ground_truth
    if truth is None:
        raise SystemExit(f'{recording} has no ground truth')
    stamps = [frame.stamp for frame in source.frames(lambda damage: None)]
    for interval in INTERVALS:
        yield row(source.name, f'interpolated over {interval:g} s', (
            error for sparse in thinned(truth, interval)
            for error in errors(truth, sparse, stamps)))
    for distance in DISTANCES:
        yield row(source.name, f'from a pose {1e3 * distance:g} ms away', (
            error for shift in (-distance, distance)
            for error in errors(truth, truth, stamps, shift)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('recordings', nargs='+', metavar='RECORDING')
    print('| recording | pose | RMS [mm] | largest [mm] | RMS [deg] | largest [deg] |\n'
          '|---|---|---|---|---|---|')
    for recording in parser.parse_args().recordings:
        print(*rows(recording), sep='\n')


if __name__ == '__main__':
    main()
