# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
How level odom is, by the first accelerations and where poses are held back for more.

    python benchmarks/level_start.py FRAMES SEED...
    python benchmarks/level_start.py FOLDER...

Rendered rooms, 320x240 at 30 Hz, with a Kinect's noise: a camera that is carried from the first
frame on, and one that rests for two seconds before. The tilt is the angle between z of odom and
what is up, at the first pose and at the last one.

A FOLDER of the TUM dataset has ``accelerometer.txt`` and ``groundtruth.txt``, by motion capture.
Of it, the table has what is estimated of the accelerometer: its position along the axes of the
colour camera (x right, y down, z forward), its time offset, and gravity in the last frame. Each
sigma is the reported standard deviation, the largest one of all directions.
"""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from weights import frames_of

from aick_ros.evaluation.scores.ground_truth import true_pose
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.odometry.level_start import begun_level
from aick_ros.settings import ImuSettings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
REST = 2.0  # s
AHEAD = NANOSECONDS // 50  # how much longer an image takes to arrive than a sample
WAITS = 0.0, ImuSettings.level_wait
MODELS = [name for name in IMU_MODELS if name != 'perfect']  # at rest it looks like one that hangs

Frames = list[RgbdFrame]


class Rested:
    """The path of a source that begins after a rest, from which it starts smoothly."""

    def __init__(self, source: SyntheticSource, start: int) -> None:
        self._source, self._start = source, start

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` at a time [s]."""
        since = max(time - REST, 0.0)
        gone = since ** 2 / 2 if since < 1.0 else since - 0.5
        return self._source.pose(self._start + round(NANOSECONDS * gone))


def source(seed: int, count: int, model: str, rests: bool) -> SyntheticSource:
    """Return a recording in the room of a seed."""
    options = SyntheticOptions(seed=seed, frames=count, camera=CAMERA, imu=IMU_MODELS[model])
    plain = SyntheticSource(options)
    if not rests:
        return plain
    return SyntheticSource(options, plain.scene, Rested(plain, options.start))


def with_imu(frames: Frames, recording: SyntheticSource) -> Frames:
    """Return frames with the samples of another IMU on the same path."""
    samples, before, result = recording.imu, None, []
    assert samples is not None
    for frame in frames:
        end = frame.stamp + AHEAD
        result.append(dataclasses.replace(frame, imu=samples.until(end, before)))
        before = end
    return result


def followed(odometry: Odometry, frames: Frames, wait: float
             ) -> tuple[list[OdometryUpdate], float]:
    """Return the updates of a new odometry, and how long they were held back [s]."""
    made = list[int]()

    def updates() -> Iterator[OdometryUpdate]:
        for frame in frames:
            made.append(frame.stamp)
            yield odometry.register_frame(frame)
    found, held = [], None
    for update in begun_level(odometry, ImuSettings(level_wait=wait), updates()):
        held = made[-1] if held is None else held
        found.append(update)
    return found, seconds(frames[0].stamp, held or frames[-1].stamp)


def tilt(update: OdometryUpdate, truth: np.ndarray) -> float:
    """Return the angle between z of odom and what is up [deg]."""
    T_odom_world = update.T_odom_camera @ se3.inverse(truth)
    return float(np.degrees(np.arccos(np.clip(T_odom_world[2, 2], -1.0, 1.0))))


def rows(seed: int, count: int) -> Iterator[str]:
    """Yield the rows of one room."""
    for rests in (False, True):
        frames = list(source(seed, count, MODELS[0], rests).frames())
        for model in MODELS:
            recording = source(seed, count, model, rests)
            figures, held = list[float](), 0.0
            for wait in WAITS:
                updates, held = followed(
                    Odometry(), with_imu(frames, recording), wait)
                figures += [tilt(updates[i], recording.ground_truth.poses[i]) for i in (0, -1)]
            sigma = np.degrees(np.sqrt(updates[0].pose.covariance[3:5, 3:5].diagonal().max()))
            yield (f'| {seed}{", rests" if rests else ""} | {model} | {figures[0]:.2f} | '
                   f'{figures[1]:.2f} | {held:.1f} | {figures[2]:.2f} | {figures[3]:.2f} | '
                   f'{sigma:.1f} |')


def pose_at(truth: Trajectory, stamp: int) -> np.ndarray:
    """Return ``T_world_camera`` by motion capture at a stamp [ns], 4x4."""
    pose = true_pose(truth, stamp)
    if pose is None:
        raise SystemExit(f'the ground truth does not cover {stamp} ns')
    return pose


def row_of(folder: str) -> str:
    """Return the row of a recording."""
    frames, truth = frames_of(folder, sys.maxsize)
    plain, _ = followed(Odometry(), frames, 0.0)
    odometry = Odometry()
    first = followed(odometry, frames, ImuSettings.level_wait)[0][0]
    is_turned = not np.array_equal(first.T_odom_camera, plain[0].T_odom_camera)
    gravity = odometry.gravity
    estimate = gravity.estimate
    if estimate is None or gravity.up is None or gravity.stamp is None:
        raise SystemExit(f'{folder} has no accelerations that were used')
    true_up = pose_at(truth, gravity.stamp)[2, :3]
    error = np.degrees(np.arccos(np.clip(gravity.up @ true_up, -1.0, 1.0)))
    x, y, z = estimate.lever_arm
    return (f'| {Path(folder).name} | {tilt(first, pose_at(truth, first.stamp)):.1f} | '
            f'{"yes" if is_turned else "no"} | {x:.2f}, {y:.2f}, {z:.2f} | '
            f'{estimate.lever_arm_sigma:.2f} | {1e3 * estimate.time_offset:.0f} | '
            f'{1e3 * estimate.time_offset_sigma:.0f} | {error:.1f} | '
            f'{math.degrees(gravity.tilt_sigma):.1f} |')


def print_recordings(folders: list[str]) -> None:
    """Print a table of recordings."""
    print('| recording | tilt at the start [deg] | turned | position [m] | sigma [m] | '
          'time offset [ms] | sigma [ms] | gravity off at the end [deg] | sigma [deg] |\n'
          '|---|---|---|---|---|---|---|---|---|')
    for folder in folders:
        print(row_of(folder), flush=True)


def print_rooms(count: int, seeds: list[int]) -> None:
    """Print a table of rendered rooms."""
    print('| room | IMU | first [deg] | last [deg] | held back [s] | first [deg] | last [deg] | '
          'sigma [deg] |\n|---|---|---|---|---|---|---|---|')
    for seed in seeds:
        for line in rows(seed, count):
            print(line, flush=True)


def main() -> None:
    """Print a table."""
    arguments = sys.argv[1:]
    are_rooms = all(each.isdecimal() and not Path(each).is_dir() for each in arguments)
    if len(arguments) < 1 + are_rooms:
        sys.exit(__doc__)
    cv2.setNumThreads(1)
    if are_rooms:
        count, *seeds = map(int, arguments)
        print_rooms(count, seeds)
    else:
        print_recordings(arguments)


if __name__ == '__main__':
    main()
