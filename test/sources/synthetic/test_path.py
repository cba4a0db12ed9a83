# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The path is that of a hand: smooth, at believable speeds, and never through things."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.sources.synthetic.path import HandheldPath
from aick_ros.sources.synthetic.scene import Zone

ZONE = Zone(np.array([-0.9, -0.7, 1.05]), np.array([0.9, 0.7, 1.55]))
RATE = 30.0


@pytest.fixture(scope='module', params=range(6))
def poses(request):
    """Return one minute of a path."""
    path = HandheldPath(np.random.default_rng(request.param), ZONE)
    return np.array([path.pose(i / RATE) for i in range(int(60 * RATE))])


def turns(poses):
    return np.array([se3.log_rotation(one[:3, :3].T @ other[:3, :3])
                     for one, other in zip(poses, poses[1:])])


def test_poses_are_rigid_and_inside_the_zone(poses):
    rotations = poses[:, :3, :3]
    np.testing.assert_allclose(rotations @ rotations.transpose(0, 2, 1),
                               np.broadcast_to(np.eye(3), rotations.shape), atol=1e-12)
    assert np.all(np.linalg.det(rotations) > 0)
    assert np.all((poses[:, :3, 3] >= ZONE.low) & (poses[:, :3, 3] <= ZONE.high))


def test_speeds_are_those_of_a_hand(poses):
    speed = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) * RATE
    turn_rate = np.degrees(np.linalg.norm(turns(poses), axis=1)) * RATE
    assert 0.2 < speed.mean() < 0.5
    assert speed.max() < 1.3
    assert 10 < turn_rate.mean() < 40
    assert turn_rate.max() < 100


def test_motion_is_smooth(poses):
    # between frames velocity changes by a small part of itself: 3 m/s^2 and 300 deg/s^2
    velocity, turn_rate = np.diff(poses[:, :3, 3], axis=0) * RATE, turns(poses) * RATE
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() * RATE < 3.0
    assert np.degrees(np.linalg.norm(np.diff(turn_rate, axis=0), axis=1)).max() * RATE < 300


def test_all_six_degrees_of_freedom_are_used(poses):
    velocity = np.einsum('nji,nj->ni', poses[:-1, :3, :3], np.diff(poses[:, :3, 3], axis=0)) * RATE
    assert np.all(velocity.std(axis=0) > 0.05)
    assert np.all(np.degrees(turns(poses)).std(axis=0) * RATE > 2.0)


def test_looks_ahead_and_a_little_down_with_the_head_up(poses):
    assert np.all(np.abs(poses[:, 2, 2]) < np.sin(np.radians(50)))  # the optical axis
    assert poses[:, 2, 2].mean() < 0
    assert np.all(poses[:, 2, 1] < -0.6)  # y of the image points to the floor


def test_another_seed_is_another_path():
    one, other = (HandheldPath(np.random.default_rng(seed), ZONE).pose(1.0) for seed in (1, 2))
    assert np.linalg.norm(one[:3, 3] - other[:3, 3]) > 0.01
