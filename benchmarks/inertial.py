# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What an IMU brings, with and without its gyroscope, and what a gyroscope that lies costs.

    python benchmarks/inertial.py SEED...

Rendered rooms, 320x240 at 30 Hz, with a Kinect's noise and a BMI055: a handheld camera, for 5 s
and for 20 s, in which the bias of the gyroscope becomes known; one that is shaken at up to
300 deg/s with 10 ms of exposure; one that turns by 90 deg in a second without light or depth; and
one whose driver hangs for the last two of 5 s, so that its images do not change.
Axes that are off are those that nobody has calibrated, of both sensors: with standard deviations,
each measures 1 % of all three, and all are turned by 1 deg about each, beside the pose that is
known of the IMU. One that is mounted wrongly is turned by 5 deg beside that.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Iterator

import cv2
import numpy as np

from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.run_errors import RunErrors
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.sources.synthetic import ColourSensor, SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
SHAKE = np.radians([12.0, 14.0, 6.0]), np.array([3.0, 2.5, 2.8])  # amplitude, frequency [Hz]
DARK = 3.0, 4.0  # s; the camera turns meanwhile
FROZEN = 3.0  # s

AXES = 0.01, np.radians(1.0)  # what an axis has of each [rad/rad]; turn of all about each [rad]
MOUNTED = np.radians(5.0)

Frames = list[RgbdFrame]
Motion = Callable[[float], np.ndarray]
Rates = Callable[[np.ndarray], np.ndarray]

LIES: dict[str, Rates] = {
    'axes turned by 90 deg': lambda rates: rates @ se3.exp_rotation((np.pi / 2, 0, 0)).T,
    'sign': lambda rates: -rates, 'in degrees': np.degrees, 'zeros': np.zeros_like,
    'stuck': lambda rates: np.full_like(rates, 0.2)}


class Moved:
    """The path of a source with another motion added."""

    def __init__(self, source: SyntheticSource, start: int, before: Motion, after: Motion) -> None:
        self._source, self._start, self._before, self._after = source, start, before, after

    def pose(self, time: float) -> np.ndarray:
        """Return ``T_world_camera`` at a time [s]."""
        pose = self._source.pose(self._start + round(NANOSECONDS * time)).copy()
        pose[:3, :3] = self._before(time) @ pose[:3, :3] @ self._after(time)
        return pose


def still(time: float) -> np.ndarray:
    """Return no motion."""
    return np.eye(3)


def shaken(time: float) -> np.ndarray:
    """Return the rotation of a camera that is shaken from 0.5 to 3 s."""
    since = np.clip((time - 0.5) / 2.5, 0.0, 1.0)
    amplitudes, frequencies = SHAKE
    return se3.exp_rotation(np.sin(np.pi * since) ** 2 * amplitudes * np.sin(
        2 * np.pi * frequencies * (time - 0.5)))


def turned(time: float) -> np.ndarray:
    """Return the rotation of a camera that turns by 90 deg in the dark."""
    share = np.clip((time - DARK[0]) / (DARK[1] - DARK[0]), 0.0, 1.0)
    return se3.exp_rotation((0.0, 0.0, np.pi / 2 * share ** 2 * (3.0 - 2.0 * share)))


def rendered(seed: int, count: int, before: Motion = still, after: Motion = still,
             shutter: float = 0.008) -> tuple[Frames, Trajectory]:
    """Return the frames of a room, and the true path."""
    options = SyntheticOptions(seed=seed, frames=count, camera=CAMERA, imu=IMU_MODELS['bmi055'],
                               colour=ColourSensor(shutter=shutter))
    plain = SyntheticSource(options)
    source = SyntheticSource(options, plain.scene, Moved(plain, options.start, before, after))
    return list(source.frames()), source.ground_truth


def with_imu(frames: Frames, change: Callable[[ImuSamples], ImuSamples]) -> Frames:
    """Return frames with other samples."""
    return [dataclasses.replace(frame, imu=frame.imu and change(frame.imu)) for frame in frames]


def with_rates(frames: Frames, change: Rates) -> Frames:
    """Return frames with other turn rates."""
    return with_imu(frames, lambda imu: dataclasses.replace(
        imu, turn_rates=change(imu.turn_rates)))


def with_wrong_axes(frames: Frames, seed: int) -> Frames:
    """Return frames whose samples are by axes that nobody has calibrated."""
    rng = np.random.default_rng(seed)
    errors = [np.eye(3) + AXES[0] * rng.standard_normal((3, 3)) for _ in range(2)]
    turn = se3.exp_rotation(AXES[1] * rng.standard_normal(3))  # of the whole IMU
    gyroscope, accelerometer = (error @ turn for error in errors)
    return with_imu(frames, lambda imu: dataclasses.replace(
        imu, turn_rates=imu.turn_rates @ gyroscope.T,
        accelerations=imu.accelerations @ accelerometer.T))


def mounted_wrongly(frames: Frames, seed: int) -> Frames:
    """Return frames whose IMU is turned about an axis of any direction."""
    axis = np.random.default_rng([seed, 7]).standard_normal(3)
    turn = se3.exp_rotation(MOUNTED * axis / np.linalg.norm(axis))
    return with_imu(frames, lambda imu: dataclasses.replace(
        imu, turn_rates=imu.turn_rates @ turn.T, accelerations=imu.accelerations @ turn.T))


def not_measured(rates: np.ndarray) -> np.ndarray:
    """Return the turn rates of an IMU without a gyroscope."""
    return np.full_like(rates, np.nan)


def without_imu(frames: Frames) -> Frames:
    """Return frames that have neither turn rates nor accelerations."""
    return [dataclasses.replace(frame, imu=None) for frame in frames]


def in_the_dark(frames: Frames) -> Frames:
    """Return frames of which those of the turn have neither light nor depth."""
    start, end = (frames[0].stamp + round(NANOSECONDS * time) for time in DARK)
    return [dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                                depth=np.full_like(frame.depth, np.nan))
            if start < frame.stamp <= end else frame for frame in frames]


def frozen(frames: Frames) -> Frames:
    """Return frames whose images do not change from some time on, as of a driver that hangs."""
    start = frames[0].stamp + round(NANOSECONDS * FROZEN)
    last = max((frame for frame in frames if frame.stamp <= start), key=lambda frame: frame.stamp)
    return [frame if frame.stamp <= start else dataclasses.replace(
        frame, colour=last.colour, depth=last.depth) for frame in frames]


def row(name: str, frames: Frames, truth: Trajectory) -> str:
    """Return the row of a Markdown table."""
    odometry, updates, named = Odometry(), [], ''
    for frame in frames:
        updates.append(odometry.register_frame(frame))
        if odometry.gyroscope.complaint and not named:
            named = f'{seconds(frames[0].stamp, frame.stamp):.1f} s'
    errors = compare(Trajectory(truth.stamps, np.array([u.T_odom_camera for u in updates])), truth)
    assert errors is not None  # the poses have the stamps of the truth
    translations, rotations = errors.relative()
    ate, rpe, turn = (np.sqrt(np.mean(values ** 2))
                      for values in (errors.positions(), translations, rotations))
    increments = RunErrors.of([FrameRecord.of(update) for update in updates], truth).accepted
    off = sum(error.is_wrong for error in increments)
    nees = Consistency.of(error.nees for error in increments).nees_mean
    lost = sum(not update.status.ok for update in updates)
    end = se3.difference(
        se3.inverse(updates[0].T_odom_camera) @ updates[-1].T_odom_camera,
        se3.inverse(truth.poses[0]) @ truth.poses[-1])
    return (f'| {name} | {lost} | {off} | {1e3 * ate:.1f} | {1e3 * rpe:.2f} | '
            f'{np.degrees(turn):.3f} | {1e3 * np.linalg.norm(end[:3]):.1f} | '
            f'{np.degrees(np.linalg.norm(end[3:])):.2f} | {nees:.1f} | {named} |')


def rows(seed: int) -> Iterator[str]:
    """Yield the rows of one room."""
    handheld = rendered(seed, 150)
    for name, (frames, truth) in (
            ('handheld', handheld), ('shaken', rendered(seed, 90, after=shaken, shutter=0.01)),
            ('dark turn', rendered(seed, 123, before=turned))):
        if name == 'dark turn':
            frames = in_the_dark(frames)
        yield row(f'{name}:{seed}, no IMU', without_imu(frames), truth)
        yield row(f'{name}:{seed}, no gyroscope', with_rates(frames, not_measured), truth)
        yield row(f'{name}:{seed}, with it', frames, truth)
        yield row(f'{name}:{seed}, its axes off', with_wrong_axes(frames, seed), truth)
        if name == 'dark turn':
            yield row(f'{name}:{seed}, mounted wrongly', mounted_wrongly(frames, seed), truth)
    hanging = frozen(handheld[0])
    yield row(f'frozen:{seed}, no IMU', without_imu(hanging), handheld[1])
    yield row(f'frozen:{seed}, with it', hanging, handheld[1])
    frames, truth = rendered(seed, 600)
    yield row(f'handheld, 20 s:{seed}, no IMU', without_imu(frames), truth)
    yield row(f'handheld, 20 s:{seed}, with it', frames, truth)
    for name, lie in LIES.items():
        yield row(f'handheld:{seed}, {name}', with_rates(handheld[0], lie), handheld[1])


def main() -> None:
    """Print a table."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    cv2.setNumThreads(1)
    print('| recording | lost | off | ATE [mm] | RPE 1 s [mm] | [deg] | at the end [mm] | [deg] | '
          'NEES | named at |\n|---|---|---|---|---|---|---|---|---|---|')
    for seed in map(int, sys.argv[1:]):
        for line in rows(seed):
            print(line, flush=True)


if __name__ == '__main__':
    main()
