# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
A robot on wheels along a rendered corridor: six directions, planar, and with a gyroscope.

    python benchmarks/corridor.py SEED LENGTH [perfect] [driving]

The camera is 0.6 m above the floor of a robot that drives 0.8 m/s, 320x240 at 10 Hz, with a
Kinect's noise, or perfect images; the IMU is an ICM-42688. It stands still for three seconds, or
drives from the start. For each: errors of height and yaw at the end, the standard deviation of
yaw by the covariance of the pose, and the position error. 100 m take five minutes.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Sequence

import cv2
import numpy as np

from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.settings import OdometrySettings, Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.corridor import corridor
from aick_ros.sources.synthetic.imu import IMU_MODELS
from aick_ros.sources.synthetic.wander import Wander

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
SPEED, RATE, MARGIN = 0.8, 10.0, 1.5  # m/s, Hz, m from the walls at the ends
REST = 3.0  # s, before it drives; it speeds up in a second
HEADING = np.radians(35.0)  # of the camera from along the corridor towards the shelves

T_BASE_CAMERA = np.eye(4)
T_BASE_CAMERA[:3, :3] = se3.exp_rotation((0.0, 0.0, HEADING)) @ np.array(
    [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
T_BASE_CAMERA[:3, 3] = 0.1, 0.0, 0.6


class Drive:
    """
    The path of the camera of a robot that drives along a corridor, in slight curves.

    :param rest: before it drives [s].
    """

    def __init__(self, seed: int, length: float, rest: float) -> None:
        self._rest = rest
        rng = np.random.default_rng(seed)
        self._start = MARGIN - length / 2
        self._yaw = Wander(rng, np.radians(4.0), ((0.6, 0.1, 0.2), (0.4, 0.3, 0.5)))

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` at a time [s]."""
        driven = time
        if self._rest:
            driven = max(time - self._rest, 0.0)
            driven = 0.5 * driven ** 2 if driven < 1.0 else driven - 0.5
        T_world_base = np.eye(4)
        T_world_base[:3, :3] = se3.exp_rotation((0.0, 0.0, self._yaw.at(driven)))
        T_world_base[0, 3] = self._start + SPEED * driven
        return T_world_base @ T_BASE_CAMERA


def rendered(seed: int, length: float, words: Sequence[str]
             ) -> tuple[list[RgbdFrame], Trajectory]:
    """Return the frames and the true path."""
    rest = 0.0 if 'driving' in words else REST
    count = int(((length - 2 * MARGIN) / SPEED + rest) * RATE)
    make = SyntheticOptions.perfect if 'perfect' in words else SyntheticOptions
    options = make(seed=seed, frames=count, rate=RATE, camera=CAMERA, imu=IMU_MODELS['icm42688'])
    source = SyntheticSource(options, corridor(seed, length), Drive(seed, length, rest))
    return list(source.frames()), source.ground_truth


def followed(frames: Sequence[RgbdFrame], settings: Settings) -> list[OdometryUpdate]:
    """Return the updates of all frames."""
    odometry = Odometry(settings)
    return [odometry.register_frame(frame, T_base_camera=T_BASE_CAMERA) for frame in frames]


def row(name: str, updates: Sequence[OdometryUpdate], truth: Trajectory) -> str:
    """Return the row of a Markdown table."""
    found = Trajectory(truth.stamps, np.array([update.T_odom_camera for update in updates]))
    errors = compare(found, truth)
    assert errors is not None  # the poses have the stamps of the truth
    first, last = truth.poses[0], truth.poses[-1]
    # the error at the end in the axes of the robot at the start
    R_base_odom = T_BASE_CAMERA[:3, :3] @ found.poses[0][:3, :3].T
    expected = found.poses[0] @ se3.inverse(first) @ last
    error = se3.difference(found.poses[-1], expected).reshape(2, 3) @ R_base_odom.T
    covariance = R_base_odom @ updates[-1].pose.covariance[3:, 3:] @ R_base_odom.T
    ate = float(np.sqrt(np.mean(np.square(errors.positions()))))
    lost = sum(not update.status.ok for update in updates[1:])
    return (f'| {name} | {1e3 * error[0, 2]:.0f} | {np.degrees(error[1, 2]):.2f} | '
            f'{np.degrees(np.sqrt(covariance[2, 2])):.2f} | {1e3 * ate:.0f} | {lost} |')


def main() -> None:
    """Print a table."""
    cv2.setNumThreads(1)
    frames, truth = rendered(int(sys.argv[1]), float(sys.argv[2]), sys.argv[3:])
    images = [dataclasses.replace(frame, imu=None) for frame in frames]
    planar = Settings(odometry=OdometrySettings(planar=True))
    print('| | height at the end [mm] | yaw at the end [deg] | its sigma [deg] | ATE [mm] | '
          'lost |')
    print('|---|---|---|---|---|---|')
    for name, chosen, settings in (('six directions', images, Settings()),
                                   ('planar', images, planar),
                                   ('planar, gyroscope', frames, planar)):
        print(row(name, followed(chosen, settings), truth), flush=True)


if __name__ == '__main__':
    main()
