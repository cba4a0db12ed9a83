# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered camera with an IMU: small errors, and rotation through darkness."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.registration.status import Status
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
    assert 1.0 < np.mean(nees) < 9.0


def test_in_the_dark_the_rotation_goes_on(rendered, updates):
    true = se3.inverse(rendered[1][0]) @ rendered[1][-1]
    ends = {has_imu: updates[has_imu][-1] for has_imu in (False, True)}
    assert all(update.status is Status.TOO_FEW_KEYPOINTS for update in ends.values())
    error = {has_imu: se3.angle(true[:3, :3].T @ end.T_odom_camera[:3, :3])
             for has_imu, end in ends.items()}
    assert error[False] > np.radians(5.0)
    assert error[True] < np.radians(0.2)


def test_the_covariance_of_a_dark_frame_is_that_of_the_gyroscope(updates):
    sigmas = np.sqrt(np.diag(updates[True][-1].pose.covariance))
    assert (sigmas[3:] < np.radians(0.5)).all()
    assert (sigmas[:3] > 0.03).all()
