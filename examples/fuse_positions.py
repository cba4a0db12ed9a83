#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The covariance in a filter: visual increments fused with noisy positions, once a second.

The positions are simulated from the ground truth, as a GPS or an indoor beacon would measure them.
A ready-made filter is robot_localization: docs/consumers.md.

usage: fuse_positions.py SOURCE     a recording with ground truth, for example synthetic:1
"""

import sys
from collections.abc import Iterator

import cv2
import numpy as np

from aick_ros import Increment, InputError, Odometry, PoseWithCovariance, RgbdSource, open_source

SIGMA = 0.01  # of a measured position [m]


class PositionFilter:
    """Extended Kalman filter of a pose; its error is that of :class:`PoseWithCovariance`."""

    def __init__(self, start: PoseWithCovariance) -> None:
        self.pose = start

    def predict(self, increment: Increment) -> None:
        """Move by a measured increment; composition propagates both covariances."""
        self.pose = self.pose @ increment.pose

    def update(self, position: np.ndarray, sigma: float) -> None:
        """Take in a measured position [m] with its standard deviation."""
        covariance, noise = self.pose.covariance, sigma ** 2 * np.eye(3)
        gain = covariance[:, :3] @ np.linalg.inv(covariance[:3, :3] + noise)
        correction = gain @ (position - self.pose.translation)
        matrix = self.pose.matrix.copy()
        matrix[:3, 3] += correction[:3]
        matrix[:3, :3] = cv2.Rodrigues(correction[3:])[0] @ self.pose.rotation
        keep = np.eye(6)
        keep[:, :3] -= gain
        self.pose = PoseWithCovariance(
            matrix, keep @ covariance @ keep.T + gain @ noise @ gain.T)


def fuse(source: RgbdSource, period: float = 1.0
         ) -> Iterator[tuple[PoseWithCovariance, np.ndarray]]:
    """Yield the fused pose and the true one, 4x4, for each tracked frame."""
    path = source.ground_truth
    if path is None:
        raise InputError(f'{source.name} has no ground truth to simulate positions from')
    rng = np.random.default_rng(0)
    odometry, fused, fixed = Odometry(), None, 0
    for frame in source.frames():
        update, truth = odometry.register_frame(frame), path.at(frame.stamp)
        if truth is None or not update.status.ok:
            continue
        if fused is None:
            fused, fixed = PositionFilter(PoseWithCovariance(truth)), frame.stamp
        elif update.increment is not None:
            fused.predict(update.increment)
        if frame.stamp - fixed >= period * 1e9:
            fused.update(truth[:3, 3] + rng.normal(0.0, SIGMA, 3), SIGMA)
            fixed = frame.stamp
        yield fused.pose, truth


def main(path: str) -> None:
    """Print error and standard deviation of the fused position for each frame."""
    for pose, truth in fuse(open_source(path)):
        error = np.linalg.norm(pose.translation - truth[:3, 3])
        sigma = np.sqrt(np.trace(pose.covariance[:3, :3]))
        print(f'error {1e3 * error:.1f} mm, sigma {1e3 * sigma:.1f} mm')


if __name__ == '__main__':
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        main(sys.argv[1])
    except InputError as error:  # says what is wrong, where, and what to do
        sys.exit(str(error))
