# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A rendered camera at rest, and one that is nearly at rest."""

import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

SMALL = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
OPTIONS = SyntheticOptions(seed=5, frames=6, rate=0.5, camera=SMALL)


@pytest.fixture(scope='module')
def at_rest(room):
    """Return the updates of 30 frames of one view, each with noise of its own."""
    source, rng, odometry = SyntheticSource(OPTIONS, room(5)), np.random.default_rng(0), Odometry()
    plain = SyntheticSource(SyntheticOptions.perfect(seed=5, frames=1, camera=SMALL), room(5))
    view = next(plain.frames())
    assert np.allclose(plain.pose(view.stamp), source.pose(OPTIONS.start))
    return [odometry.register_frame(RgbdFrame(
        view.stamp + index * NANOSECONDS // 10, OPTIONS.colour.measure(view.colour, 1.0, rng),
        OPTIONS.depth.measure(view.depth, SMALL, rng), SMALL)) for index in range(30)]


def test_at_rest_nothing_drifts(at_rest):
    errors = np.array([se3.difference(update.T_odom_camera, np.eye(4)) for update in at_rest])
    assert np.linalg.norm(errors[:, :3], axis=1).max() < 0.002
    assert np.linalg.norm(errors[:, 3:], axis=1).max() < np.radians(0.05)
    half = np.abs(errors[:15]).mean(axis=0)
    assert (np.abs(errors[15:]).mean(axis=0) < 3 * half + 1e-4).all()


def test_at_rest_increments_err_as_their_covariance_says(at_rest):
    increments = [update.increment.pose for update in at_rest[2:]]
    errors = [se3.difference(pose.matrix, np.eye(4)) for pose in increments]
    nees = [error @ np.linalg.solve(pose.covariance, error)
            for error, pose in zip(errors, increments)]
    assert 2.5 < np.mean(nees) < 9.0


class Straight:
    """A path from the first pose of a source with a constant velocity."""

    def __init__(self, start, velocity):
        self._start, self._velocity = start, velocity

    def pose(self, time):
        return self._start @ se3.exp(time * self._velocity)


@pytest.mark.parametrize('velocity', [
    (1e-3, 0, 0, 0, 0, 0), (0, 0, 0, 0, np.radians(0.1), 0)], ids=['1 mm/s', '0.1 deg/s'])
def test_who_moves_very_slowly_is_not_at_rest(room, velocity):
    start = SyntheticSource(OPTIONS, room(5)).pose(OPTIONS.start)
    source = SyntheticSource(OPTIONS, room(5), Straight(start, np.array(velocity)))
    odometry = Odometry()
    last = [odometry.register_frame(frame) for frame in source.frames()][-1]
    moved = se3.difference(last.T_odom_camera, np.eye(4))
    expected = 10.0 * np.array(velocity)
    assert np.linalg.norm(moved[:3] - expected[:3]) < 0.002
    assert np.linalg.norm(moved[3:] - expected[3:]) < np.radians(0.1)
