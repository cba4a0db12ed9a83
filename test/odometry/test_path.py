# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The path of a camera before and after its first frame, without images."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.path import Path
from aick_ros.registration.systematic_error import errors_of_scale
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

START = se3.exp([1.0, 2.0, 3.0, 0.3, -0.2, 0.5])
MOTION = se3.exp([0.3, -0.1, 0.2, 0.2, 0.1, -0.1])


def path_with(start=START, **odometry):
    """Return a path without a gyroscope, which begins at a pose, 4x4."""
    settings = with_values(Settings(), {
        f'odometry.{name}': value for name, value in odometry.items()})
    path = Path(settings, lambda start, end: None)
    path.configure(settings, None)
    path.reset(start)
    return path


@pytest.mark.parametrize('start', [None, START])
def test_it_begins_at_the_pose_given_without_keyframes(start):
    path = path_with(start)
    np.testing.assert_array_equal(path.published.matrix, np.eye(4) if start is None else start)
    assert not path.published.covariance.any()
    assert path.local_map().shape == (0, 3)


def test_a_pose_that_is_not_rigid_changes_nothing():
    path = path_with()
    with pytest.raises(InputError, match='T_odom_camera'):
        path.reset(2.0 * np.eye(4))
    np.testing.assert_array_equal(path.published.matrix, START)


def test_it_moves_by_dead_reckoning_and_begins_anew_where_it_was_published():
    path = path_with()
    moved = path.move_to(PoseWithCovariance(START @ MOTION, 1e-4 * np.eye(6)))
    np.testing.assert_array_equal(moved.matrix, START @ MOTION)
    path.restart()
    np.testing.assert_array_equal(path.published.matrix, moved.matrix)
    scale = errors_of_scale((START @ MOTION - START)[:3, 3], 0.005)
    np.testing.assert_allclose(path.published.covariance, moved.covariance + scale)


def test_a_published_pose_has_the_scale_error_of_depth_by_its_distance_from_the_beginning():
    """Once, whatever number of frames it took; back at the beginning there is none."""
    path, there = path_with(), np.array([3.0, -4.0, 0.0])
    for share in (0.25, 0.5, 1.0):
        moved = START.copy()
        moved[:3, 3] += share * there
        path.move_to(PoseWithCovariance(moved))
    sigma = 0.005 * 5.0  # m
    np.testing.assert_allclose(path.published.covariance[:3, :3] @ there, sigma ** 2 * there)
    path.move_to(PoseWithCovariance(START))
    assert not path.published.covariance.any()


@pytest.mark.parametrize('planar', [False, True])
def test_poses_are_in_the_plane_if_there_is_one(planar, monkeypatch):
    monkeypatch.setattr('aick_ros.odometry.path.KeyframeMemory', lambda *_: None)
    monkeypatch.setattr('aick_ros.odometry.path.Reference', lambda prepared, pose: pose)

    class Prepared:
        stamp = NANOSECONDS

    path = path_with(np.eye(4), planar=planar)
    first = path.start(Prepared())
    np.testing.assert_array_equal(first.matrix, np.eye(4))
    risen = PoseWithCovariance(se3.exp([0.1, 0, 0.5, 0, 0, 0]), np.eye(6))
    for pose in (path.fused(risen), path.move_to(risen), path.published):
        height = pose.matrix[2, 3]
        assert abs(height) < 1e-3 if planar else height == 0.5
        assert pose.matrix[0, 3] == pytest.approx(0.1)


def test_the_velocity_is_that_along_the_axes_of_the_camera():
    """Of a camera that moves evenly to the left of where it looks, turned by a right angle."""
    path, turned = path_with(), se3.exp([0, 0, 0, 0, 0, np.pi / 2])
    assert path.velocity_at(0, PoseWithCovariance(turned, 1e-6 * np.eye(6))) is None
    for number in range(1, 30):
        at = turned.copy()
        at[0, 3] = 0.02 * number
        velocity = path.velocity_at(round(0.1 * number * NANOSECONDS),
                                    PoseWithCovariance(at, 1e-6 * np.eye(6)))
    np.testing.assert_allclose(velocity, [0, -0.2, 0], atol=1e-3)
