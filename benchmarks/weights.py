# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether the weights that are measured are as good as the best fixed ones, whatever the camera.

    python benchmarks/weights.py [--frames N] CAMERA...

A CAMERA is a recording with ground truth, or a rendered room by one of four kinds of cameras:
``kinect:SEED``, ``stereo:SEED``, ``time-of-flight:SEED``, and a Kinect with one of the defects of
``misalignment.py``, as ``turned:SEED``, whose depth is registered 15 mm and 2 degrees wrong. Pairs
of frames are registered as ``aick evaluate`` does, with the defaults, which learn the noise of
keypoints and of depth as they go, and with that learning switched off and
``refinement.track_sigma`` fixed: the smaller it is, the more keypoints weigh.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from unittest import mock

import numpy as np
from camera_table import print_camera_table
from misalignment import KINDS, Misaligned

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.pair_evaluation import PairEvaluation
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.synthetic import DepthSensor, SyntheticOptions, SyntheticSource

GAPS = 1, 5, 10
THRESHOLDS = 0.0033, 0.01  # m
TRACK_SIGMAS = 0.2, 0.6, 2.0, 6.0  # px; the second is the setting
FRAMES = 60
RATE = 15.0  # Hz, of the rendered cameras
SENSORS = {
    'kinect': DepthSensor(),
    'stereo': DepthSensor(sigma=0.004, grain=4.0, step=0.0, baseline=0.05, edge_jitter=1.5),
    'time-of-flight': dataclasses.replace(DepthSensor.perfect(), edge_jitter=0.5, max_depth=6.0)}
TIME_OF_FLIGHT_SIGMA = 0.006  # m, at all depths


def with_time_of_flight_noise(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a depth image with noise of one size at all depths, HxW float32 [m]."""
    return depth + np.float32(rng.normal(0.0, TIME_OF_FLIGHT_SIGMA, depth.shape))


def rendered(kind: str, seed: int, count: int) -> tuple[list[RgbdFrame], Trajectory]:
    """Return the first frames of a rendered room, with the ground truth."""
    if kind in KINDS:
        wrong = Misaligned(kind, seed)
        return list(itertools.islice(wrong.frames(), count)), wrong.ground_truth
    source = SyntheticSource(SyntheticOptions(seed=seed, frames=count, rate=RATE,
                                              depth=SENSORS[kind]))
    frames = list(source.frames())
    if kind == 'time-of-flight':
        rng = np.random.default_rng(seed)
        frames = [dataclasses.replace(frame, depth=with_time_of_flight_noise(frame.depth, rng))
                  for frame in frames]
    return frames, source.ground_truth


def recorded(recording: str, count: int) -> tuple[list[RgbdFrame], Trajectory]:
    """
    Return the first frames of a recording, with the ground truth.

    :raises InputError: where it cannot be read, or has no ground truth or no frame.
    """
    source = open_source(recording)
    if source.ground_truth is None:
        raise InputError(f'{recording} has no ground truth')
    frames = list(itertools.islice(source.frames(raise_damage), count))
    if not frames:
        raise InputError(f'{recording} has no usable frame')
    return frames, source.ground_truth


def frames_of(camera: str, count: int) -> tuple[list[RgbdFrame], Trajectory]:
    """
    Return the first frames of a camera, with the ground truth.

    :raises SystemExit: where it cannot be used, with the reason.
    """
    kind, _, seed = camera.partition(':')
    if seed.isdecimal() and (kind in SENSORS or kind in KINDS):
        return rendered(kind, int(seed), count)
    try:
        return recorded(camera, count)
    except InputError as error:
        raise SystemExit(str(error)) from None


def errors(frames: list[RgbdFrame], truth: Trajectory,
           settings: Settings) -> dict[int, np.ndarray]:
    """Return gap -> translation errors of its pairs [m], infinite where they failed."""
    odometry, pairs = Odometry(settings), PairEvaluation(settings, truth, GAPS)
    for frame in frames:
        pairs.add(odometry.register_frame(frame).prepared)
    return {gap: np.array([error.translation for error in found])
            for gap, found in pairs.errors().items()}


def shares(found: dict[int, np.ndarray]) -> np.ndarray:
    """Return the shares of the pairs below the thresholds, thresholds x gaps."""
    return np.array([[np.mean(found[gap] < threshold) for gap in GAPS]
                     for threshold in THRESHOLDS])


def rows(camera: str, count: int) -> Iterator[str]:
    """Yield the rows of a Markdown table: defaults, fixed weights, and the best of those."""
    def row(name: str, values: np.ndarray) -> str:
        cells = (' / '.join(f'{value:.2f}' for value in line) for line in values)
        return f'| {camera} | {name} | ' + ' | '.join(cells) + ' |'

    frames, truth = frames_of(camera, count)
    measured = shares(errors(frames, truth, Settings()))
    yield row('measured', measured)
    fixed = []
    with mock.patch.object(MeasuredNoise, 'learn', lambda noise, sample: None):
        for sigma in TRACK_SIGMAS:
            settings = with_values(Settings(), {'refinement.track_sigma': sigma})
            fixed.append(shares(errors(frames, truth, settings)))
            yield row(f'fixed, {sigma:g} px', fixed[-1])
    yield row('measured less the best fixed', measured - np.max(fixed, axis=0))


def main() -> None:
    """Print a table, some rows per camera."""
    gaps = ' / '.join(map(str, GAPS))
    print_camera_table(__doc__.split('\n\n')[0],
                       ('camera', 'weights', f'within 3.3 mm, gap {gaps}', 'within 10 mm'),
                       FRAMES, rows)


if __name__ == '__main__':
    main()
