# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A camera at rest, and a board that passes before it with a large part of the keypoints."""

from pathlib import Path

import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource, prints

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
BEFORE, WIDTH, DISTANCE = 8, 96, 1.2  # frames, px, m
LEAP = 5  # px a frame, 0.7 m/s at 30 Hz


def frames_of(seed):
    """Yield noisy frames of one view of a room, before which a board passes."""
    options = SyntheticOptions.perfect(seed=seed, frames=1, camera=CAMERA)
    view, rng = SyntheticSource(options).frame(0), np.random.default_rng(seed)
    board = prints.spines(rng, 0.45, 1.3)
    board = board[:CAMERA.height * (len(board) // CAMERA.height):len(board) // CAMERA.height,
                  ::board.shape[1] // WIDTH][:CAMERA.height, :WIDTH]
    noisy = SyntheticOptions(seed=seed, frames=1, camera=CAMERA)
    for index in range(BEFORE + (CAMERA.width + WIDTH) // LEAP + 1):
        colour, depth = view.colour.copy(), view.depth.copy()
        left = LEAP * (index - BEFORE) - WIDTH
        seen = slice(max(left, 0), max(min(left + WIDTH, CAMERA.width), 0))
        colour[:, seen] = board[:, seen.start - left:seen.stop - left]
        depth[:, seen] = DISTANCE
        yield RgbdFrame(view.stamp + index * NANOSECONDS // 30,
                        noisy.colour.measure(colour, 1.0, rng),
                        noisy.depth.measure(depth, CAMERA, rng), CAMERA)


@pytest.mark.parametrize('seed', [1, 5])
def test_it_does_not_carry_the_camera_with_it(seed):
    """It moves by 2.2 m."""
    odometry = Odometry()
    updates = [odometry.register_frame(frame) for frame in frames_of(seed)]
    assert all(update.status.ok for update in updates[1:])
    errors = [se3.difference(update.T_odom_camera, np.eye(4)) for update in updates]
    assert np.linalg.norm(np.array(errors)[:, :3], axis=1).max() < 0.02
    assert np.linalg.norm(np.array(errors)[:, 3:], axis=1).max() < np.radians(1.0)


@pytest.mark.parametrize('share, end', [(1 / 2, 90), (2 / 3, 95)])
def test_it_stays_known_before_a_wall(load, share, end):
    """Depth shows no motion along the wall, which is most of what a board leaves of a room."""
    passing = load(Path(__file__).parents[2] / 'benchmarks' / 'passing.py')
    passage = passing.Passage(24, share, 0.7, is_held=False)
    seen = range(18, end)  # until it would carry the camera along by a third of a metre
    frames = passing.measured(map(passage.picture, seen), 24)
    assert passing.errors_of(frames, passage.poses[seen.start:seen.stop]).largest < 100.0  # mm
