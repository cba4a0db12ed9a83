# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
How far odom tilts over minutes, with and without an accelerometer.

    python benchmarks/upright.py [--minutes M] SEED...

Rendered rooms, 320x240 at 10 Hz, with a Kinect's noise: a camera in a hand, with a BMI085 at 200
Hz. Printed is the angle between z of odom and what is up in the world, minute by minute, with what
is reported of it at the end: the largest standard deviation of roll and pitch, of all directions.
Without an accelerometer the odometry is given the true tilt at the start; with it, poses are held
back until odom is level. Ten minutes take three.
"""

from __future__ import annotations

import argparse
import dataclasses
import itertools
from collections.abc import Iterator

import cv2
import numpy as np
from inertial import CAMERA
from level_start import tilt

from aick_ros.odometry import Odometry
from aick_ros.odometry.level_start import begun_level
from aick_ros.settings import ImuSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

RATE = 10.0  # Hz


def tilts(seed: int, minutes: float) -> tuple[list[float], list[float], float]:
    """Return the tilt of each frame by images alone and with an IMU, and its sigma [deg]."""
    source = SyntheticSource(SyntheticOptions(
        seed=seed, frames=round(60 * RATE * minutes), rate=RATE, camera=CAMERA,
        imu=IMU_MODELS['bmi085']))
    truth = source.ground_truth.poses
    by_images, level = Odometry(T_odom_camera=truth[0]), Odometry()
    of_images, of_imu = itertools.tee(source.frames())
    images = (dataclasses.replace(frame, imu=None) for frame in of_images)
    found: tuple[list[float], list[float]] = [], []
    for true, *updates in zip(
            truth, map(by_images.register_frame, images),
            begun_level(level, ImuSettings(), map(level.register_frame, of_imu))):
        for angles, update in zip(found, updates):
            angles.append(tilt(update, true))
    covariance = updates[1].pose.covariance[3:5, 3:5]
    return *found, float(np.degrees(np.sqrt(np.linalg.eigvalsh(covariance)[-1])))


def rows(seed: int, minutes: float) -> Iterator[str]:
    """Yield the rows of one room."""
    by_images, level, sigma = tilts(seed, minutes)
    step = round(60 * RATE)
    for name, angles, said in (('images alone', by_images, ''), ('IMU', level, f'{sigma:.2f}')):
        each = ' / '.join(f'{angle:.2f}' for angle in [*angles[::step], angles[-1]])
        yield f'| {seed} | {name} | {each} | {max(angles):.2f} | {said} |'


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('seeds', type=int, nargs='+', metavar='SEED')
    parser.add_argument('--minutes', type=float, default=10.0)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print('| room | by | tilt of odom, each minute [deg] | largest [deg] | sigma at the end [deg] '
          '|\n|---|---|---|---|---|')
    for seed in options.seeds:
        for row in rows(seed, options.minutes):
            print(row, flush=True)


if __name__ == '__main__':
    main()
