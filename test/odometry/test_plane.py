# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A base in a plane: against the least-squares problem solved by itself, and rendered."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import Odometry
from aick_ros.odometry.plane import Plane
from aick_ros.settings import OdometrySettings, Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.3, -0.2, 0.5))
START = se3.exp([1.0, 2.0, 3.0, 0.3, -0.2, 0.8])
SETTINGS = OdometrySettings(planar=True, planar_sigma=0.004, planar_tilt_sigma=0.003)


def above(T_odom_base):
    """Return height above the plane of the start and tilt against it, 3."""
    seen = se3.inverse(START) @ T_odom_base
    return np.array([seen[2, 3], seen[1, 2], seen[0, 2]])


def drifted(seed=0):
    """Return a pose of the camera near the plane, with a covariance."""
    rng = np.random.default_rng(seed)
    base = START @ se3.from_roll_pitch_yaw(0.0, 0.0, 0.7, (4.0, -3.0, 0.0))
    root = 0.02 * rng.standard_normal((6, 6))
    return PoseWithCovariance(
        se3.perturbed(base @ T_BASE_CAMERA, 0.01 * rng.standard_normal(6)), root @ root.T)


def fused_in(plane, pose, T_base_camera=T_BASE_CAMERA):
    plane.mount(T_base_camera)
    return plane.fused(pose)


@pytest.fixture
def plane():
    """Return the plane of a base that began at START."""
    plane = Plane(SETTINGS)
    plane.mount(T_BASE_CAMERA)
    plane.begin(START @ T_BASE_CAMERA)
    return plane


def test_it_is_the_minimum_of_both_squared_errors(plane):
    pose = drifted()
    fused = fused_in(plane, pose, T_BASE_CAMERA)
    information = np.linalg.inv(pose.covariance)
    weights = 1.0 / np.array([0.004, 0.003, 0.003]) ** 2

    def cost(error):
        moved = se3.perturbed(fused.matrix, error)
        change = se3.difference(moved, pose.matrix)
        return change @ information @ change + weights @ above(
            moved @ se3.inverse(T_BASE_CAMERA)) ** 2

    step = 1e-4
    gradient = [(cost(step * axis) - cost(-step * axis)) / (2 * step) for axis in np.eye(6)]
    curvature = [(cost(step * axis) + cost(-step * axis) - 2 * cost(0 * axis)) / step ** 2
                 for axis in np.eye(6)]
    # as far as the problem is linear
    assert np.abs(np.array(gradient) / curvature).max() < 3e-4
    variances = np.diag(np.linalg.inv(fused.covariance))
    assert np.allclose(variances, 0.5 * np.array(curvature), rtol=0.05)


def test_a_base_in_the_plane_stays_where_it_is(plane):
    base = START @ se3.from_roll_pitch_yaw(0.0, 0.0, -2.0, (-1.0, 5.0, 0.0))
    pose = PoseWithCovariance(base @ T_BASE_CAMERA, 1e-4 * np.eye(6))
    fused = fused_in(plane, pose, T_BASE_CAMERA)
    assert np.allclose(fused.matrix, pose.matrix, atol=1e-9)
    assert (np.linalg.eigvalsh(pose.covariance - fused.covariance) > -1e-12).all()


@pytest.mark.parametrize('seed', [1, 2])
def test_what_is_certain_stays_and_what_is_not_is_drawn_into_the_plane(plane, seed):
    pose = drifted(seed)
    exact = PoseWithCovariance(pose.matrix, 1e-12 * np.eye(6))
    unknown = PoseWithCovariance(pose.matrix, np.eye(6))
    assert np.allclose(plane.fused(exact).matrix, pose.matrix, atol=1e-6)
    fused = plane.fused(unknown)
    assert np.abs(above(fused.matrix @ se3.inverse(T_BASE_CAMERA))).max() < 2e-4


def test_the_extrinsic_of_the_frame_counts(plane):
    lifted = T_BASE_CAMERA.copy()
    lifted[2, 3] += 0.3  # a camera on a lift
    base = START @ se3.from_roll_pitch_yaw(0.0, 0.0, 0.4, (2.0, 1.0, 0.0))
    pose = PoseWithCovariance(base @ lifted, np.eye(6))
    fused = fused_in(plane, pose, lifted)
    assert np.allclose(fused.matrix, pose.matrix, atol=1e-9)


def test_without_an_extrinsic_the_plane_is_that_of_the_first_axes():
    plane = Plane(SETTINGS)
    first = se3.exp([1.0, 2.0, 3.0, -1.2, 0.4, 0.3])
    plane.begin(first)
    assert not plane.has_base
    moved = se3.perturbed(first, np.array([3.0, -2.0, 0.0, 0.0, 0.0, 1.0]))
    pose = PoseWithCovariance(moved, np.eye(6))
    assert np.allclose(plane.fused(pose).matrix, moved, atol=1e-9)
    lifted = PoseWithCovariance(se3.perturbed(moved, np.array([0, 0, 1.0, 0, 0, 0])), np.eye(6))
    assert np.allclose(plane.fused(lifted).matrix, moved, atol=1e-4)


def test_switched_off_or_before_the_first_pose_it_changes_nothing(plane):
    pose = drifted()
    assert plane.fused(pose) is not pose
    plane.reset()
    assert plane.fused(pose) is pose
    plane.begin(pose.matrix)
    plane.configure(OdometrySettings())
    assert plane.fused(pose) is pose


def test_the_plane_stays_until_a_reset(plane):
    """Also where the next recording begins above it."""
    base = START @ se3.from_roll_pitch_yaw(0.0, 0.0, 0.4, (2.0, 1.0, 0.0))
    lifted = base.copy()
    lifted[:3, 3] += 0.5 * START[:3, 2]
    pose = PoseWithCovariance(lifted @ T_BASE_CAMERA, np.eye(6))
    plane.begin(pose.matrix)
    assert above(plane.fused(pose).matrix @ se3.inverse(T_BASE_CAMERA))[0] < 1e-3
    plane.reset()
    plane.begin(pose.matrix)
    assert np.allclose(plane.fused(pose).matrix, pose.matrix, atol=1e-9)


def test_a_base_is_mounted_on_a_plane_that_is_used(plane):
    assert plane.has_base
    plane.configure(OdometrySettings())
    assert not plane.has_base
    plane.configure(SETTINGS)
    with pytest.raises(InputError, match='T_base_camera'):
        plane.mount(np.zeros((4, 4)))
    assert plane.has_base  # the one before stays
    plane.mount(None)
    assert not plane.has_base


def test_other_settings_are_how_even_the_same_plane_is(plane):
    """A height and a tilt are drawn into it by their own standard deviations."""
    pose = drifted()
    left = []
    for height, tilt in ((1.0, 0.5), (1e-5, 0.5), (1.0, 1e-5)):
        plane.configure(dataclasses.replace(SETTINGS, planar_sigma=height,
                                            planar_tilt_sigma=tilt))
        left.append(np.abs(above(plane.fused(pose).matrix @ se3.inverse(T_BASE_CAMERA))))
    either, height, tilt = left
    assert height[0] < 1e-4 < either[0] and height[1:].max() > 1e-3
    assert tilt[1:].max() < 1e-4 < either[1:].max() and tilt[0] > 1e-3


def test_one_that_was_none_begins_anew(plane):
    """As above a ramp, which is no part of the plane."""
    other = drifted().matrix
    plane.configure(OdometrySettings())
    plane.configure(SETTINGS)
    pose = drifted()
    assert plane.fused(pose) is pose  # not begun yet
    plane.begin(other)
    np.testing.assert_allclose(plane.fused(pose).matrix, other, atol=1e-12)


def off_the_plane(error):
    """Return a pose of the camera whose base is off the plane by a twist."""
    base = se3.perturbed(START @ se3.from_roll_pitch_yaw(0.0, 0.0, 0.7, (4.0, -3.0, 0.0)), error)
    return PoseWithCovariance(base @ T_BASE_CAMERA, 1e-6 * np.eye(6))


def test_a_camera_that_leaves_the_plane_again_and_again_is_named(plane):
    up = START[:3, 2]
    above_it = off_the_plane(np.append(0.05 * up, np.zeros(3)))
    tilted = off_the_plane(np.append(np.zeros(3), np.radians(2.0) * START[:3, 0]))
    inside = off_the_plane(np.zeros(6))
    for pose in (above_it, *20 * [inside], above_it):
        found = plane.measured(pose)
        np.testing.assert_allclose(found.matrix, plane.fused(pose).matrix, atol=1e-12)
    assert plane.complaint == ''  # as on a threshold between two rooms
    for _ in range(20):
        plane.measured(above_it)
    assert plane.complaint.startswith('the camera moves by 0.05 m and 0.0 deg out of the plane')
    plane.measured(tilted)
    assert ' 2.0 deg out of the plane' in plane.complaint
    for _ in range(100):
        plane.measured(inside)
    assert plane.complaint == ''


def test_a_plane_that_is_forgotten_or_switched_off_is_complained_of_no_more(plane):
    above_it = off_the_plane(np.append(0.05 * START[:3, 2], np.zeros(3)))
    for _ in range(20):
        plane.measured(above_it)
    assert plane.complaint
    plane.configure(OdometrySettings())
    assert plane.complaint == ''
    assert plane.measured(above_it) is above_it
    plane.configure(SETTINGS)  # the plane begins anew
    assert plane.complaint == ''


@pytest.fixture(scope='module')
def carried(room):
    """Return frames of a camera that is carried by hand, the last one dark."""
    source = SyntheticSource(SyntheticOptions(
        seed=5, frames=6, rate=5.0, camera=Camera(320, 240, 262.5, 262.5, 159.5, 119.5)), room(5))
    *frames, last = source.frames()
    return [*frames, dataclasses.replace(last, colour=np.zeros_like(last.colour),
                                         depth=np.full_like(last.depth, np.nan))]


def test_each_pose_of_the_odometry_is_drawn_into_the_plane(carried):
    """With a floor that is exactly even not even a hand leaves it."""
    heights = {}
    for planar in (False, True):
        odometry = Odometry(Settings(odometry=OdometrySettings(
            planar=planar, planar_sigma=1e-5, planar_tilt_sigma=1e-5)), START @ T_BASE_CAMERA)
        updates = [odometry.register_frame(frame, T_base_camera=T_BASE_CAMERA)
                   for frame in carried]
        assert [update.status.ok for update in updates] == [*5 * [True], False]
        bases = [update.pose @ se3.inverse(T_BASE_CAMERA) for update in updates]
        heights[planar] = np.array([above(base.matrix) for base in bases])
    assert np.abs(heights[False]).max(axis=0).min() > 5e-3
    # the position filter may leave the plane by what it holds back
    assert np.abs(heights[True]).max() < 3e-3
    axes = START[:3, :3]
    assert axes[:, 2] @ bases[-1].covariance[:3, :3] @ axes[:, 2] < 1e-3 ** 2
    assert axes[:, 0] @ bases[-1].covariance[:3, :3] @ axes[:, 0] > 1e-2 ** 2


def test_a_plane_that_is_set_on_the_way_begins_there(carried):
    """The pose goes on from where it is, as above a ramp."""
    planar = OdometrySettings(planar=True, planar_sigma=1e-5, planar_tilt_sigma=1e-5)
    odometry, heights = Odometry(Settings(), START @ T_BASE_CAMERA), []
    for index, frame in enumerate(carried[:5]):
        if index == 3:
            odometry.change_settings(Settings(odometry=planar))
        update = odometry.register_frame(frame, T_base_camera=T_BASE_CAMERA)
        base = update.T_odom_camera @ se3.inverse(T_BASE_CAMERA)
        heights.append(above(base))
    assert np.abs(heights[2]).max() > 5e-3  # a hand leaves the plane of the start
    # the position filter may leave the plane by what it holds back
    assert np.abs(np.array(heights[3:]) - heights[2])[:, 0].max() < 5e-3
    assert np.abs(heights[-1][0]) > 0.01  # and not that of the start
