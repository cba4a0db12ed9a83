# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame that is made level: slowly, about the camera, with the covariance it then has."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.inertial.level import Direction, Level, level_orientation

UP = np.array([0.0, 0.0, 1.0])
DRIFT = se3.exp_rotation([np.radians(2.0), np.radians(-1.0), 0.0])
NOISE = np.radians(0.05)
CAMERA = PoseWithCovariance(se3.exp([3.0, -1.0, 0.5, 0.2, 0.4, 1.0]),
                            np.diag(np.repeat([1e-4, NOISE], 3) ** 2))


def up(sigma=np.radians(0.1)):
    """Return what is up in a frame that has drifted, as an accelerometer shows it."""
    return Direction(DRIFT.T @ UP, sigma ** 2 * np.eye(3))


def tilt(level):
    """Return the angle that is left [rad]."""
    return se3.angle(se3.exp_rotation(se3.rotation_between(
        level.apply(PoseWithCovariance(np.eye(4))).rotation @ DRIFT.T @ UP, UP)))


def test_a_camera_that_looks_ahead_looks_along_x():
    assert np.allclose(level_orientation(np.array([0.0, -1.0, 0.0])) @ UP, [1, 0, 0])
    down = level_orientation(np.array([0.0, -np.cos(0.5), -np.sin(0.5)]))
    assert np.allclose(down @ UP, [np.cos(0.5), 0, -np.sin(0.5)])


def test_it_becomes_level_about_the_camera_and_no_faster_than_poses_err():
    level, tilts, position = Level(), [np.radians(np.sqrt(5.0))], CAMERA.translation
    for _ in range(30):
        level.approach(up(1e-5), CAMERA, 1 / 30)
        assert np.allclose(level.apply(CAMERA).translation, position, atol=1e-9)
        tilts.append(tilt(level))
    assert tilts[0] - tilts[-1] == pytest.approx(0.5 * NOISE, rel=0.02)  # in a second
    for _ in range(120 * 30):
        level.approach(up(1e-5), CAMERA, 1 / 30)
    assert tilt(level) < np.radians(0.01)


def test_what_gravity_does_not_know_is_not_corrected():
    level, start = Level(), np.radians(np.sqrt(5.0))
    for _ in range(120 * 30):
        level.approach(up(np.radians(3.0)), CAMERA, 1 / 30)
    assert tilt(level) == pytest.approx(start)
    for _ in range(120 * 30):
        level.approach(up(np.radians(0.5)), CAMERA, 1 / 30)
    assert np.degrees(tilt(level)) == pytest.approx(0.5, abs=0.01)


def test_a_step_is_no_jump_however_noisy_the_poses():
    level = Level()
    noisy = PoseWithCovariance(CAMERA.matrix, np.eye(6))
    level.approach(up(), noisy, 0.2)
    turned = level.apply(CAMERA).rotation @ CAMERA.rotation.T
    assert 0.05 < np.degrees(se3.angle(turned)) < 0.1


def test_roll_and_pitch_are_as_uncertain_as_gravity_and_what_is_left():
    level, uncertain = Level(), PoseWithCovariance(CAMERA.matrix, 0.05 ** 2 * np.eye(6))
    assert np.array_equal(level.apply(uncertain).covariance, uncertain.covariance)
    level.approach(up(0.001), CAMERA, 1e-9)
    roll, pitch, yaw = np.sqrt(np.diag(level.apply(uncertain).covariance)[3:])
    assert roll == pytest.approx(np.hypot(0.001, np.radians(2.0)), rel=0.02)
    assert pitch == pytest.approx(np.hypot(0.001, np.radians(1.0)), rel=0.02)
    assert yaw == pytest.approx(0.05)
    assert np.allclose(np.diag(level.apply(uncertain).covariance)[:3], 0.05 ** 2)
    for _ in range(3000):
        level.approach(up(0.001), CAMERA, 1 / 30)
    # and by as much is left, along the first error
    assert np.allclose(np.sqrt(np.diag(level.apply(uncertain).covariance)[3:5]),
                       0.001 * np.sqrt([1.8, 1.2]), rtol=0.05)
