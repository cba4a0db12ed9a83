# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What wheels that slip do to the pose, in light and where nothing is seen.

    python benchmarks/wheels.py SEED...

Rendered rooms, 320x240 at 30 Hz, with a Kinect's noise and a BMI055, a camera in a hand, and
wheels that measure its motion 3 % too long. In light they turn by 30 % too much for two seconds;
beside the errors is by how much that changes the position at most. In the dark, six seconds
without images or depth, they spin ahead by 0.9 m/s, for one or two seconds.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterator
from typing import NamedTuple

import cv2
import numpy as np
from inertial import CAMERA, Frames, without_imu

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.odometry.other_odometry import Predict, no_odometry
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

FRAMES = 330
LENGTH = 1.03  # of all motions, by the true one
NEVER = 0.0, 0.0  # s
SLIP, SLIPPED = (3.0, 5.0), 1.3  # s; length meanwhile
DARK = 4.0, 10.0  # s
SPINS = {'for a second': (4.3, 5.3), 'for two seconds': (5.7, 7.7)}
SPINNING = np.array([0.0, 0.0, 0.9])  # m/s, along the optical axis


class Run(NamedTuple):
    """The updates of a recording."""

    updates: list[OdometryUpdate]
    truth: Trajectory

    @property
    def positions(self) -> np.ndarray:
        """Published positions, Nx3 [m]."""
        return np.array([update.T_odom_camera[:3, 3] for update in self.updates])

    def error_at(self, time: float) -> float:
        """Return the error of the position since the first frame, at a time of it [s], [mm]."""
        index = _index(self.truth, time)
        found = se3.inverse(self.updates[0].T_odom_camera) @ self.updates[index].T_odom_camera
        true = se3.inverse(self.truth.poses[0]) @ self.truth.poses[index]
        return 1e3 * float(np.linalg.norm(found[:3, 3] - true[:3, 3]))

    def largest_step(self, times: tuple[float, float]) -> float:
        """Return how far the position moves in a frame at most, between two times [s], [mm]."""
        first, last = (_index(self.truth, time) for time in times)
        steps = np.linalg.norm(np.diff(self.positions[first:last], axis=0), axis=1)
        return 1e3 * float(steps.max())


def _index(truth: Trajectory, time: float) -> int:
    """Return the first frame from a time on [s]; the last frame at the end."""
    stamp = truth.stamps[0] + round(NANOSECONDS * time)
    return min(int(np.searchsorted(truth.stamps, stamp)), len(truth.stamps) - 1)


def overlap(start: int, end: int, times: tuple[float, float], first: int) -> float:
    """Return for how long two stamps [ns] are between two times since a first stamp [s]."""
    return max(min(seconds(first, end), times[1]) - max(seconds(first, start), times[0]), 0.0)


def wheels(truth: Trajectory, slip: tuple[float, float] = NEVER,
           spin: tuple[float, float] = NEVER) -> Predict:
    """
    Return wheels that measure the true motion 3 % too long.

    :param slip: times between which they turn by 30 % too much [s].
    :param spin: times between which they spin ahead [s].
    """
    index = {int(stamp): i for i, stamp in enumerate(truth.stamps)}
    first = int(truth.stamps[0])

    def predict(start: int, end: int) -> np.ndarray:
        motion = se3.inverse(truth.poses[index[start]]) @ truth.poses[index[end]]
        share = overlap(start, end, slip, first) / max(seconds(start, end), 1e-9)
        motion = se3.exp((LENGTH + share * (SLIPPED - 1.0)) * se3.log(motion))
        motion[:3, 3] += overlap(start, end, spin, first) * SPINNING
        return motion
    return predict


def in_the_dark(frames: Frames) -> Frames:
    """Return frames of which some have neither light nor depth."""
    first, (start, end) = frames[0].stamp, DARK
    return [dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                                depth=np.full_like(frame.depth, np.nan))
            if start < seconds(first, frame.stamp) <= end else frame for frame in frames]


def followed(frames: Frames, truth: Trajectory, predict: Predict = no_odometry) -> Run:
    """Return the updates of a new odometry."""
    odometry = Odometry()
    return Run([odometry.register_frame(frame, predict) for frame in frames], truth)


def rows(seed: int) -> Iterator[tuple[str, ...]]:
    """Yield the rows of one room."""
    source = SyntheticSource(SyntheticOptions(seed=seed, frames=FRAMES, camera=CAMERA,
                                              imu=IMU_MODELS['bmi055']))
    frames, truth = list(source.frames()), source.ground_truth
    images = without_imu(frames)
    honest = followed(images, truth, wheels(truth))
    slipped = followed(images, truth, wheels(truth, slip=SLIP))
    change = 1e3 * np.linalg.norm(slipped.positions - honest.positions, axis=1).max()
    yield (str(seed), 'light', '30 % too much', 'no', f'{honest.error_at(SLIP[1]):.1f}',
           f'{slipped.error_at(SLIP[1]):.1f}', f'{change:.2f}', '')
    dark, dark_images = in_the_dark(frames), without_imu(in_the_dark(frames))
    for name, spin in SPINS.items():
        for chosen, has_imu in ((dark_images, 'no'), (dark, 'yes')):
            honest, spun = (followed(chosen, truth, wheels(truth, spin=times))
                            for times in (NEVER, spin))
            yield (str(seed), 'dark', name, has_imu, f'{honest.error_at(DARK[1]):.0f}',
                   f'{spun.error_at(DARK[1]):.0f}', '', f'{spun.largest_step(DARK):.0f}')


def main() -> None:
    """Print a table."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    cv2.setNumThreads(1)
    print('| room | seen in | wheels slip | IMU | error without slip [mm] | with it [mm] | '
          'changed by [mm] | largest step [mm] |\n|---|---|---|---|---|---|---|---|')
    for seed in map(int, sys.argv[1:]):
        for row in rows(seed):
            print(f'| {" | ".join(row)} |', flush=True)


if __name__ == '__main__':
    main()
