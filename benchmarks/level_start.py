# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
How level odom is, by the first accelerations and where poses are held back for more.

    python benchmarks/level_start.py FRAMES SEED...

Rendered rooms, 320x240 at 30 Hz, with a Kinect's noise: a camera that is carried from the first
frame on, and one that rests for two seconds before. The tilt is the angle between z of odom and
what is up, at the first pose and at the last one.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Iterator

import cv2
import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS, seconds
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


def followed(frames: Frames, wait: float) -> tuple[list[OdometryUpdate], float]:
    """Return the updates of an odometry, and how long they were held back [s]."""
    odometry, made = Odometry(), list[int]()

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
                updates, held = followed(with_imu(frames, recording), wait)
                figures += [tilt(updates[i], recording.ground_truth.poses[i]) for i in (0, -1)]
            sigma = np.degrees(np.sqrt(updates[0].pose.covariance[3:5, 3:5].diagonal().max()))
            yield (f'| {seed}{", rests" if rests else ""} | {model} | {figures[0]:.2f} | '
                   f'{figures[1]:.2f} | {held:.1f} | {figures[2]:.2f} | {figures[3]:.2f} | '
                   f'{sigma:.1f} |')


def main() -> None:
    """Print a table."""
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    cv2.setNumThreads(1)
    print('| room | IMU | first [deg] | last [deg] | held back [s] | first [deg] | last [deg] | '
          'sigma [deg] |\n|---|---|---|---|---|---|---|---|')
    count = int(sys.argv[1])
    for seed in map(int, sys.argv[2:]):
        for line in rows(seed, count):
            print(line, flush=True)


if __name__ == '__main__':
    main()
