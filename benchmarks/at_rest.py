# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Drift and consistency of a camera at rest.

    python benchmarks/at_rest.py SEED SECONDS

One view of a rendered room, 320x240 at 5 Hz, each frame with a Kinect's noise of its own.
"""

from __future__ import annotations

import sys

import cv2
import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
RATE = 5  # Hz


def errors_at_rest(seed: int, duration: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors of N poses, Nx6 [m, rad], and the NEES of the increments."""
    options = SyntheticOptions(seed=seed, frames=1, camera=CAMERA)
    plain = SyntheticSource(SyntheticOptions.perfect(seed=seed, frames=1, camera=CAMERA))
    view, rng, odometry = next(plain.frames()), np.random.default_rng(seed), Odometry()
    errors, nees = [], []
    for index in range(duration * RATE):
        update = odometry.register_frame(RgbdFrame(
            view.stamp + index * NANOSECONDS // RATE,
            options.colour.measure(view.colour, 1.0, rng),
            options.depth.measure(view.depth, CAMERA, rng), CAMERA))
        errors.append(se3.difference(update.T_odom_camera, np.eye(4)))
        if update.increment is not None:
            error = se3.difference(update.increment.pose.matrix, np.eye(4))
            nees.append(error @ np.linalg.solve(update.increment.pose.covariance, error))
    return np.array(errors), np.array(nees)


def main() -> None:
    """Print the largest errors of the poses, and the mean NEES of the increments."""
    cv2.setNumThreads(1)
    seed, duration = map(int, sys.argv[1:])
    errors, nees = errors_at_rest(seed, duration)
    positions, rotations = (np.linalg.norm(errors[:, part], axis=1)
                            for part in (slice(0, 3), slice(3, 6)))
    print(f'{duration} s at rest: errors of poses up to {1e3 * positions.max():.2f} mm and '
          f'{np.degrees(rotations.max()):.4f} deg, in the last minute '
          f'{1e3 * positions[-60 * RATE:].max():.2f} mm and '
          f'{np.degrees(rotations[-60 * RATE:].max()):.4f} deg; NEES of increments '
          f'{np.mean(nees):.1f}, {np.mean(nees < 12.59):.2f} of them inside 95 %')


if __name__ == '__main__':
    main()
