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


def settled():
    """Return a level frame some time after its begin, which has not turned meanwhile."""
    level = Level()
    level.approach(up(np.radians(3.0)), CAMERA, 20.0)
    assert tilt(level) == pytest.approx(np.radians(np.sqrt(5.0)))
    return level


def test_it_becomes_level_about_the_camera_and_no_faster_than_poses_err():
    level, tilts, position = settled(), [np.radians(np.sqrt(5.0))], CAMERA.translation
    for _ in range(30):
        level.approach(up(1e-5), CAMERA, 1 / 30)
        assert np.allclose(level.apply(CAMERA).translation, position, atol=1e-9)
        tilts.append(tilt(level))
    assert tilts[0] - tilts[-1] == pytest.approx(0.5 * NOISE, rel=0.02)  # in a second
    for _ in range(120 * 30):
        level.approach(up(1e-5), CAMERA, 1 / 30)
    assert tilt(level) < np.radians(0.01)


def test_in_its_first_seconds_it_turns_the_slower_the_younger_it_is():
    level, tilts = Level(), []
    for _ in range(50 * 30):
        level.approach(up(1e-5), CAMERA, 1 / 30)
        tilts.append(tilt(level))
    speeds = -np.diff(tilts) * 30
    for seconds, share in ((1, 0.05), (5, 0.25), (10, 0.5), (20, 1.0), (45, 1.0)):
        assert speeds[30 * seconds - 2] == pytest.approx(share * 0.5 * NOISE, rel=0.04)


def test_what_gravity_does_not_know_is_not_corrected():
    level, start = Level(), np.radians(np.sqrt(5.0))
    for _ in range(120 * 30):
        level.approach(up(np.radians(3.0)), CAMERA, 1 / 30)
    assert tilt(level) == pytest.approx(start)
    for _ in range(120 * 30):
        level.approach(up(np.radians(0.5)), CAMERA, 1 / 30)
    assert np.degrees(tilt(level)) == pytest.approx(0.5, abs=0.01)


def test_a_step_is_no_jump_however_noisy_the_poses():
    level = settled()
    noisy = PoseWithCovariance(CAMERA.matrix, np.eye(6))
    level.approach(up(), noisy, 0.2)
    turned = level.apply(CAMERA).rotation @ CAMERA.rotation.T
    assert 0.05 < np.degrees(se3.angle(turned)) < 0.1


def test_roll_and_pitch_are_as_uncertain_as_gravity_and_what_is_left():
    level, uncertain = settled(), PoseWithCovariance(CAMERA.matrix, 0.05 ** 2 * np.eye(6))
    assert np.array_equal(Level().apply(uncertain).covariance, uncertain.covariance)
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


def test_a_direction_and_its_covariance_are_turned_together():
    """Against the spread of directions that are drawn."""
    root = np.random.default_rng(0).normal(size=(3, 3))
    direction = Direction(np.array([0.6, 0.0, 0.8]), root @ root.T).in_axes(CAMERA.rotation)
    np.testing.assert_allclose(direction.vector, CAMERA.rotation @ [0.6, 0.0, 0.8])
    draws = root @ np.random.default_rng(1).normal(size=(3, 100_000))
    np.testing.assert_allclose(direction.covariance, np.cov(CAMERA.rotation @ draws), atol=0.1)


@pytest.mark.parametrize('turn', [0.0, 0.5 * np.pi])
def test_gravity_that_errs_along_x_leaves_the_pitch_uncertain(turn):
    """A rotation about y moves what is up along x; also where the frame has been turned."""
    level, rotation = Level(), se3.exp_rotation([0, 0, turn])
    level._T_level_drifted[:3, :3] = rotation
    along_x = rotation.T @ np.diag([0.004, 0.001, 0.0]) ** 2 @ rotation
    level.approach(Direction(UP, along_x), CAMERA, 1 / 30)
    uncertain = PoseWithCovariance(CAMERA.matrix, np.eye(6))
    roll, pitch, _ = np.sqrt(np.diag(level.apply(uncertain).covariance)[3:])
    assert (roll, pitch) == (pytest.approx(0.001, rel=1e-3), pytest.approx(0.004, rel=1e-3))


def test_what_is_less_certain_than_gravity_is_kept_and_correlations_with_it():
    """The estimate is that of a Kalman filter: never less certain than both give."""
    level = Level()
    level.approach(Direction(UP, 0.01 ** 2 * np.diag([1.0, 1.0, 0.0])), CAMERA, 1 / 30)
    root = np.random.default_rng(3).normal(0.0, 0.01, (6, 6))
    pose = PoseWithCovariance(CAMERA.matrix, root @ root.T)
    found = level.apply(pose).covariance
    # rotations by the information of both; positions are not corrected, but stay correlated
    tilt = np.eye(2, 6, 3)
    gain = pose.covariance @ tilt.T @ np.linalg.inv(
        tilt @ pose.covariance @ tilt.T + 0.01 ** 2 * np.eye(2))
    expected = (np.eye(6) - gain @ tilt) @ pose.covariance
    np.testing.assert_allclose(found[3:, 3:], expected[3:, 3:], atol=1e-12)
    np.testing.assert_allclose(found[:3, :3], pose.covariance[:3, :3])


def test_a_third_of_the_error_is_corrected_in_a_second_at_most():
    """Where poses are noisy enough, and from three seconds on all of it, up to a jump."""
    small = se3.exp_rotation([1e-4, 0.0, 0.0])
    noisy = PoseWithCovariance(CAMERA.matrix, np.eye(6))
    for elapsed, share in ((0.3, 0.1), (1.5, 0.5), (3.0, 1.0), (9.0, 1.0)):
        level = settled()
        level.approach(Direction(small.T @ UP, 1e-20 * np.eye(3)), noisy, elapsed)
        turned = se3.log_rotation(level.apply(CAMERA).rotation @ CAMERA.rotation.T)
        np.testing.assert_allclose(turned, [share * 1e-4, 0, 0], atol=1e-9)
