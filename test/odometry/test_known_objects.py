# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A picture that is carried into the view of a camera at rest, until it hides most of the room."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.odometry.keyframe_choice import KeyframeChoice
from aick_ros.registration.refinement import refinement
from aick_ros.registration.refinement.known_objects import KnownObjects
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
WIDTH, ROWS, NEAR = 170, slice(5, 235), 1.0  # px, and m away
RATE = 30
LEFT = [*2 * [-WIDTH], *range(12 - WIDTH, 60, 12),
        *(round(60 - 40 * np.sin(number / 6)) for number in range(1, 20))]
"""Where its left edge is from frame to frame [px]: it comes, and is swung to and fro."""


@pytest.fixture(scope='module', params=[2, 3])
def frames(request):
    """Return those of a camera at rest in a room."""
    room = SyntheticSource(SyntheticOptions(seed=request.param, frames=1, camera=CAMERA)).frame(0)
    picture = SyntheticSource(SyntheticOptions(seed=77, frames=1, camera=CAMERA)).frame(0).colour
    rng = np.random.default_rng(3)

    def frame(number, left):
        colour = room.colour + rng.integers(-2, 3, room.colour.shape)
        depth = room.depth + 0.001 * room.depth ** 2 * rng.standard_normal(room.depth.shape)
        first, last = max(left, 0), min(left + WIDTH, CAMERA.width)
        if last > first:
            colour[ROWS, first:last] = picture[ROWS, first - left:last - left]
            depth[ROWS, first:last] = NEAR
        stamp = room.stamp + number * NANOSECONDS // RATE
        return dataclasses.replace(
            room, stamp=stamp, depth_stamp=stamp,
            colour=np.clip(colour, 0, 255).astype(np.uint8), depth=depth.astype(np.float32))

    return [frame(number, left) for number, left in enumerate(LEFT)]


def largest_error(frames):
    """Return the largest error of the position of a camera that has not moved [m]."""
    odometry = Odometry()
    return max(np.linalg.norm(se3.difference(
        odometry.register_frame(frame).T_odom_camera, np.eye(4))[:3]) for frame in frames)


def without_memory(monkeypatch):
    monkeypatch.setattr(KnownObjects, 'of', lambda *_: None)


def without_what_moved_in(monkeypatch):
    """As if nothing were known of free space."""
    monkeypatch.setattr(KeyframeChoice, '_on_objects', lambda *_: 0)
    monkeypatch.setattr(refinement, 'on_intruders', lambda frame, *_: np.zeros(
        len(frame.keypoints), bool))


@pytest.mark.parametrize('without', [(), (without_memory,), (without_what_moved_in,)],
                         ids=['both', 'the keyframe', 'the memory'])
def test_it_does_not_carry_the_camera_along(frames, monkeypatch, without):
    """The keyframe from before it came does, and so does the memory of what has moved."""
    for change in without:
        change(monkeypatch)
    assert largest_error(frames) < 0.003


def test_it_does_where_each_pair_of_frames_is_looked_at_by_itself(frames, monkeypatch):
    without_memory(monkeypatch)
    without_what_moved_in(monkeypatch)
    assert largest_error(frames) > 0.01
