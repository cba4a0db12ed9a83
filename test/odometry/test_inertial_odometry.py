# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered camera with an IMU: small errors, rotation through darkness, a level frame."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
from aick_ros.settings import ImuSettings, Settings
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

COUNT, DARK = 22, range(16, 22)
TURN_RATE = np.array([0.0, 0.0, 1.5])  # rad/s, about the world's z, once it is dark
SMALL = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


class Turning:
    """The path of a source that turns away after the last frame before the dark."""

    def __init__(self, source, start):
        self._source, self._start = source, start

    def pose(self, time):
        turned = self._source.pose(self._start + round(NANOSECONDS * time)).copy()
        turned[:3, :3] = se3.exp_rotation(
            max(time - DARK[0] / 30, 0.0) * TURN_RATE) @ turned[:3, :3]
        return turned


@pytest.fixture(scope='module')
def rendered(room):
    """Return frames and the true poses; the last frames are dark, without depth."""
    options = SyntheticOptions(seed=5, frames=COUNT, camera=SMALL, imu=IMU_MODELS['icm42688'])
    straight = SyntheticSource(options, room(5))
    source = SyntheticSource(options, room(5), Turning(straight, options.start))
    frames = [source.frame(i) for i in range(COUNT)]
    return [dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                                depth=np.full_like(frame.depth, np.nan))
            if i in DARK else frame for i, frame in enumerate(frames)], source.ground_truth.poses


def track(frames, has_imu):
    odometry = Odometry()
    return [odometry.register_frame(frame if has_imu else dataclasses.replace(frame, imu=None))
            for frame in frames]


@pytest.fixture(scope='module')
def updates(rendered):
    return {has_imu: track(rendered[0], has_imu) for has_imu in (False, True)}


def errors(updates, poses):
    """Return translation [m] and rotation [rad] of the increments, Nx6, and their NEES, N."""
    found = [(se3.difference(update.increment.pose.matrix, se3.inverse(before) @ now),
              update.increment.pose.covariance)
             for update, before, now in zip(updates[1:], poses, poses[1:]) if update.status.ok]
    return (np.array([error for error, _ in found]),
            np.array([error @ np.linalg.solve(covariance, error) for error, covariance in found]))


def test_increments_turn_by_smaller_errors_and_are_honest(rendered, updates):
    without, (with_imu, nees) = (errors(updates[has_imu], rendered[1])
                                 for has_imu in (False, True))
    sizes = [np.sqrt(np.mean(kind[:, 3:] ** 2)) for kind in (without[0], with_imu)]
    assert sizes[1] < 0.75 * sizes[0]
    assert 0.5 < np.mean(nees) < 9.0


def test_in_the_dark_the_rotation_goes_on(rendered, updates):
    true = se3.inverse(rendered[1][0]) @ rendered[1][-1]
    ends = {has_imu: updates[has_imu][-1] for has_imu in (False, True)}
    assert all(update.status is Status.TOO_FEW_KEYPOINTS for update in ends.values())
    error = {has_imu: se3.angle(true[:3, :3].T @ updates[has_imu][0].T_odom_camera[:3, :3].T
                                @ end.T_odom_camera[:3, :3])
             for has_imu, end in ends.items()}
    assert error[False] > np.radians(5.0)
    assert error[True] < np.radians(0.2)


def test_odom_begins_level(rendered, updates):
    first = updates[True][0]
    up = rendered[1][0][:3, :3].T @ [0, 0, 1]
    # the camera is moved by hand, at 0.4 m/s^2
    assert (first.T_odom_camera[:3, :3] @ up)[2] > np.cos(np.radians(4.0))
    assert np.array_equal(first.level_start, first.T_odom_camera)
    assert all(np.array_equal(update.level_start, first.level_start) for update in updates[True])
    assert updates[False][-1].level_start is None
    assert np.array_equal(updates[False][0].T_odom_camera, np.eye(4))


def test_a_level_frame_is_kept_without_a_jump(rendered, updates):
    increments = [[se3.inverse(before.T_odom_camera) @ now.T_odom_camera
                   for before, now in zip(updates[has_imu], updates[has_imu][1:DARK[0]])]
                  for has_imu in (False, True)]
    apart = [se3.angle(one[:3, :3].T @ other[:3, :3]) for one, other in zip(*increments)]
    assert max(apart) < np.radians(0.1)


@pytest.mark.parametrize('settings, given', [
    (Settings(), np.eye(4)), (Settings(imu=ImuSettings(gravity=False)), None)],
    ids=['a pose is given', 'gravity is switched off'])
def test_odom_is_not_level(rendered, settings, given):
    update = Odometry(settings, given).register_frame(rendered[0][0])
    assert update.level_start is None
    assert np.array_equal(update.T_odom_camera, np.eye(4))


def test_after_a_reset_odom_is_level_again(rendered, updates):
    frames, odometry = rendered[0], Odometry()
    odometry.register_frame(frames[0])
    odometry.reset()
    update = odometry.register_frame(frames[1])
    up = [update.T_odom_camera[:3, :3].T[:, 2], updates[True][1].T_odom_camera[:3, :3].T[:, 2]]
    assert up[0] @ up[1] > np.cos(np.radians(3.0))


def test_the_covariance_of_a_dark_frame_is_that_of_the_gyroscope(updates):
    sigmas = np.sqrt(np.diag(updates[True][-1].pose.covariance))
    assert (sigmas[3:] < np.radians(0.5)).all()
    assert (sigmas[:3] > 0.03).all()
