# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame that is made level: slowly, about the camera, with the covariance it then has."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.inertial import level as level_module
from aick_ros.odometry.inertial.level import Direction, Level, level_orientation

UP = np.array([0.0, 0.0, 1.0])
DRIFT = se3.exp_rotation([np.radians(2.0), np.radians(-1.0), 0.0])
NOISE = np.radians(0.05)
CAMERA = PoseWithCovariance(se3.exp([3.0, -1.0, 0.5, 0.2, 0.4, 1.0]),
                            np.diag(np.repeat([1e-4, NOISE], 3) ** 2))


@pytest.fixture(autouse=True)
def fast(monkeypatch):
    """Let it turn by a degree per second: at its own speed these tests would take minutes."""
    monkeypatch.setattr(level_module, '_FASTEST', 0.0175)


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


def test_it_turns_by_six_thousandths_of_a_degree_per_second(monkeypatch):
    """A turn bends the path: rotations over a second must not err by more."""
    monkeypatch.undo()
    level, before = Level(), np.radians(np.sqrt(5.0))
    for _ in range(30):
        level.approach(up(1e-5), CAMERA, 1 / 30)
    assert before - tilt(level) == pytest.approx(0.0001, rel=0.02)


def test_it_becomes_level_about_the_camera_as_fast_as_it_may_turn():
    level, tilts, position = Level(), [np.radians(np.sqrt(5.0))], CAMERA.translation
    for _ in range(30):
        level.approach(up(1e-5), CAMERA, 1 / 30)
        assert np.allclose(level.apply(CAMERA).translation, position, atol=1e-9)
        tilts.append(tilt(level))
    assert tilts[0] - tilts[-1] == pytest.approx(0.0175, rel=0.02)  # in a second
    for _ in range(9 * 30):
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


def test_roll_and_pitch_are_as_uncertain_as_gravity_and_what_is_left():
    level, certain = Level(), PoseWithCovariance(CAMERA.matrix, 1e-4 ** 2 * np.eye(6))
    assert np.allclose(level.apply(certain).covariance, certain.covariance)
    level.approach(up(0.001), certain, 1e-9)
    roll, pitch, yaw = np.sqrt(np.diag(level.apply(certain).covariance)[3:])
    assert roll == pytest.approx(np.hypot(0.001, np.radians(2.0)), rel=0.02)
    assert pitch == pytest.approx(np.hypot(0.001, np.radians(1.0)), rel=0.02)
    assert yaw == pytest.approx(1e-4)
    assert np.allclose(np.diag(level.apply(certain).covariance)[:3], 1e-8)
    for _ in range(3000):
        level.approach(up(0.001), certain, 1 / 30)
    # and by as much is left, along the first error
    assert np.allclose(np.sqrt(np.diag(level.apply(certain).covariance)[3:5]),
                       0.001 * np.sqrt([1.8, 1.2]), rtol=0.05)


def test_what_a_pose_has_drifted_since_gravity_was_seen_is_uncertain():
    """As in the dark, where nothing measures."""
    level = Level()
    level.approach(up(0.001), CAMERA, 1 / 30)
    known = level.apply(CAMERA).covariance
    drifted = CAMERA.with_covariance(CAMERA.covariance + np.diag([0, 0, 0, 0.2, 0.3, 0]) ** 2)
    added = level.apply(drifted).covariance - known
    np.testing.assert_allclose(added[3:5, 3:5], np.diag([0.2, 0.3]) ** 2, rtol=0.01, atol=1e-3)


def test_a_first_pose_is_as_uncertain_as_its_tilt_and_so_are_positions_away_from_it():
    """Against the spread of paths that are tilted about the first position, in 0.02 rad."""
    level, first = Level(), np.array([1.0, 2.0, 3.0])
    level.begin(first, 0.02 ** 2)
    begun, pose = np.eye(4), CAMERA.matrix
    begun[:3, 3] = first
    np.testing.assert_allclose(level.apply(PoseWithCovariance(begun)).covariance,
                               np.diag([0, 0, 0, 0.02, 0.02, 0]) ** 2, atol=1e-15)
    errors = []
    for roll, pitch in np.random.default_rng(2).normal(0.0, 0.02, (20_000, 2)):
        turn = np.array([roll, pitch, 0.0])
        errors.append(np.r_[np.cross(turn, pose[:3, 3] - first), turn])
    found = level.apply(PoseWithCovariance(pose)).covariance
    np.testing.assert_allclose(found, np.cov(np.transpose(errors)), atol=1e-4)


def test_positions_that_were_reached_tilted_are_off_by_what_is_known_now():
    """Seen at the end, or on the way: what is corrected then is no error of what follows."""
    first, along = np.zeros(3), np.array([0.0, 3.0, 0.0])
    errors = {}
    for corrected_after in (0.0, 3.0):
        level, place = Level(), np.eye(4)
        level.begin(first, 0.1 ** 2)
        for step in (0.0, 3.0):
            place[:3, 3] = step / 3.0 * along
            pose = PoseWithCovariance(place.copy(), 1e-10 * np.eye(6))
            if step >= corrected_after:
                for _ in range(300):
                    level.approach(up(1e-5), pose, 1 / 30)
        errors[corrected_after] = np.sqrt(np.diag(level.apply(pose).covariance))
    # two degrees of roll over three metres lift the path
    assert errors[3.0][2] == pytest.approx(3.0 * np.radians(2.0), rel=0.05)
    assert errors[0.0][2] < 0.01
    assert max(errors[0.0][3:5].max(), errors[3.0][3:5].max()) < 1e-4


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
    roll, pitch, _ = np.sqrt(np.diag(level.apply(CAMERA).covariance)[3:])
    assert (roll, pitch) == (pytest.approx(0.001, rel=1e-3), pytest.approx(0.004, rel=1e-3))


def test_gravity_says_nothing_of_yaw_and_position_but_by_what_correlates_with_tilt():
    level, noise = Level(), 0.002 ** 2 * np.eye(2)
    root = np.random.default_rng(3).normal(0.0, 0.01, (6, 6))
    pose = PoseWithCovariance(CAMERA.matrix, root @ root.T)
    level.approach(Direction(UP, 0.002 ** 2 * np.diag([1.0, 1.0, 0.0])), pose, 1 / 30)
    found = level.apply(pose).covariance
    tilt, others = [3, 4], [0, 1, 2, 5]
    by_tilt = pose.covariance[np.ix_(others, tilt)] @ np.linalg.inv(
        pose.covariance[np.ix_(tilt, tilt)])
    np.testing.assert_allclose(found[np.ix_(tilt, tilt)], noise, atol=1e-12)
    np.testing.assert_allclose(found[np.ix_(others, tilt)], by_tilt @ noise, atol=1e-12)
    rest = pose.covariance[np.ix_(others, others)] - by_tilt @ pose.covariance[
        np.ix_(tilt, others)]
    np.testing.assert_allclose(found[np.ix_(others, others)],
                               rest + by_tilt @ noise @ by_tilt.T, atol=1e-12)


def test_a_small_error_is_corrected_in_a_second():
    small = se3.exp_rotation([1e-4, 0.0, 0.0])
    for elapsed, share in ((0.1, 0.1), (0.5, 0.5), (1.0, 1.0)):
        level = Level()
        level.approach(Direction(small.T @ UP, 1e-20 * np.eye(3)), CAMERA, elapsed)
        turned = se3.log_rotation(level.apply(CAMERA).rotation @ CAMERA.rotation.T)
        np.testing.assert_allclose(turned, [share * 1e-4, 0, 0], atol=1e-9)


def test_a_first_pose_that_was_level_after_all_turns_all_since_about_it():
    """Against the covariance of samples: a start that is off, and a path that drifts from it."""
    rng, before, after = np.random.default_rng(0), np.radians(4.0), np.radians(0.3)
    level, position = Level(), np.array([1.0, 2.0, 3.0])
    level.begin(position, before ** 2)
    turn = np.eye(4)
    turn[:3, :3] = DRIFT
    turn[:3, 3] = position - DRIFT @ position
    held = level.apply(CAMERA)
    made = level.begin_anew(turn, up(after), CAMERA)
    found = made.apply(held)
    np.testing.assert_allclose(found.matrix, turn @ CAMERA.matrix, atol=1e-12)
    np.testing.assert_allclose(made.apply(PoseWithCovariance(
        se3.from_roll_pitch_yaw(0.0, 0.0, 0.0, position))).translation, position)
    tilts = np.column_stack([np.sqrt(after ** 2 + NOISE ** 2) * rng.standard_normal((20000, 2)),
                             np.zeros(20000)])  # that of gravity now, and the drift until then
    errors = rng.multivariate_normal(np.zeros(6), CAMERA.covariance, 20000)
    errors[:, 3:] += tilts
    errors[:, :3] += np.cross(tilts, found.translation - position)
    np.testing.assert_allclose(found.covariance, np.cov(errors.T), atol=0.04 * np.max(
        found.covariance))


def test_after_it_poses_go_on_from_those_that_were_turned():
    level = Level()
    level.begin(np.zeros(3), np.radians(4.0) ** 2)
    held, turn = level.apply(CAMERA), np.eye(4)
    turn[:3, :3] = DRIFT
    made = level.begin_anew(turn, up(), CAMERA)
    np.testing.assert_allclose(level.apply(CAMERA).matrix, made.apply(held).matrix, atol=1e-12)
    assert tilt(level) == pytest.approx(0.0, abs=1e-9)
    sigmas = [np.sqrt(np.diag(pose.covariance))
              for pose in (level.apply(CAMERA), made.apply(held))]
    # those that were turned have the drift until now, too
    np.testing.assert_allclose(*sigmas, rtol=0.25)
    np.testing.assert_allclose(sigmas[0][3:5], np.radians(0.1), rtol=1e-6)
    level.approach(up(), CAMERA, 1 / 30)
    np.testing.assert_allclose(level.apply(CAMERA).matrix, made.apply(held).matrix, atol=1e-12)


@pytest.mark.parametrize('doubt', [0.0, 0.3, 1.0])
def test_a_start_that_is_doubted_is_as_uncertain_as_the_mixture(doubt):
    """Against the spread of paths of which a part is tilted as of no accelerometer."""
    rng, first, sigma = np.random.default_rng(5), np.array([1.0, 2.0, 3.0]), 0.05
    level = Level()
    level.begin(first, sigma ** 2)
    wrong = rng.random(200_000) < doubt
    tilts = np.column_stack([
        np.where(wrong, 1.0, sigma)[:, None] * rng.standard_normal((len(wrong), 2)),
        np.zeros(len(wrong))])
    errors = np.hstack([np.cross(tilts, CAMERA.translation - first), tilts])
    expected = np.cov(errors.T) + CAMERA.covariance
    found = level.apply(CAMERA, doubt)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found.covariance, expected, atol=0.02 * scale)
    np.testing.assert_array_equal(found.matrix, CAMERA.matrix)
    turn = level.doubted(doubt)
    assert turn.is_level
    held_back = turn.apply(level.apply(CAMERA))
    np.testing.assert_array_equal(held_back.matrix, CAMERA.matrix)
    np.testing.assert_allclose(held_back.covariance, found.covariance, atol=1e-9)


def test_what_gravity_shows_of_a_start_that_was_contradicted_counts_for_nothing():
    level = Level()
    level.begin(CAMERA.translation, 0.05 ** 2)
    level.approach(up(0.001), CAMERA, 1 / 30)
    assert np.sqrt(level.apply(CAMERA).covariance[3, 3]) < np.radians(3.0)
    np.testing.assert_allclose(np.sqrt(level.apply(CAMERA, 1.0).covariance.diagonal()[3:5]), 1.0,
                               rtol=1e-5)
