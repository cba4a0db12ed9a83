# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The base follows the camera: against the conjugated chain, increments, and sampled errors."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.odometry import OdometryUpdate
from aick_ros.odometry.base_odometry import BaseOdometry, BaseState, Mount
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings

T_BASE_CAMERA = se3.from_quaternion((-0.5, 0.5, -0.5, 0.5), (0.3, -0.2, 0.5))
CORRECTED = T_BASE_CAMERA @ se3.exp([0.05, 0.02, -0.03, 0.1, -0.2, 0.05])
ORIGIN, CERTAIN = np.eye(4), np.zeros((6, 6))
PERIOD = 33_333_333  # ns


class Camera:
    """A base odometry, and frames of the camera on it at a steady rate."""

    def __init__(self, T_odom_base=ORIGIN, covariance=CERTAIN, settings=OdometrySettings()):
        self.base = BaseOdometry(PoseWithCovariance(T_odom_base, covariance), settings)
        self.stamp = 0

    def update(self, T=ORIGIN, S=CERTAIN, T_base_camera=T_BASE_CAMERA, mount=Mount.FIXED,
               status=Status.OK, **values):
        self.stamp += PERIOD
        return self.base.update(OdometryUpdate(
            self.stamp, status, '', PoseWithCovariance(T, S), None, **values),
            T_base_camera, mount)

    def follow(self, *pose, **mounted):
        """Return pose and covariance of the base for a pose of the camera."""
        pose = self.update(*pose, **mounted).pose
        return pose.matrix, pose.covariance

    def put(self, T_odom_base, covariance, *is_blind):
        self.base.set_pose(PoseWithCovariance(T_odom_base, covariance), *is_blind)


def moved_by(T, back=1, covariance=CERTAIN):
    """Return the increment of a camera over some frames."""
    return Increment(PoseWithCovariance(T, covariance), back * PERIOD / 1e9)


@pytest.fixture
def way():
    """Increments of a camera with their covariances, and the chain of both."""
    rng = np.random.default_rng(3)
    pose, way = PoseWithCovariance.identity(), [(ORIGIN, CERTAIN, None, None)]
    for _ in range(20):
        increment = se3.exp(0.1 * rng.standard_normal(6))
        root = 0.01 * rng.standard_normal((6, 6))
        pose = pose @ PoseWithCovariance(increment, root @ root.T)
        way.append((pose.matrix, pose.covariance, increment, root @ root.T))
    return way


def accumulate(steps, T_base_camera, T, S):
    """Return the pose by adding each increment in the base frame, S' = F S F' + G Q G'."""
    pose = PoseWithCovariance(T, S)
    for _, _, increment, covariance in steps:
        pose = pose @ PoseWithCovariance(increment, covariance).in_body(T_base_camera)
    return pose.matrix, pose.covariance


def test_with_a_fixed_camera_it_is_the_chain_seen_from_the_base(way):
    base = Camera(ORIGIN, CERTAIN)
    for T, S, *_ in way:
        found, covariance = base.follow(T, S, T_BASE_CAMERA)
        expected = PoseWithCovariance(T, S).in_body(T_BASE_CAMERA)
        np.testing.assert_allclose(found, expected.matrix, atol=1e-12)
        np.testing.assert_allclose(covariance, expected.covariance, atol=1e-12)


def test_a_corrected_extrinsic_does_not_move_the_base(way):
    """From then on the increments are those seen with the new one."""
    base = Camera(ORIGIN, CERTAIN)
    for T, S, *_ in way[:11]:
        before = base.follow(T, S, T_BASE_CAMERA)
    again = base.follow(*way[10][:2], CORRECTED)
    np.testing.assert_allclose(again[0], before[0], atol=1e-12)
    np.testing.assert_allclose(again[1], before[1], atol=1e-12)
    for T, S, *_ in way[11:]:
        found = base.follow(T, S, CORRECTED)
    expected = accumulate(way[11:], CORRECTED, *accumulate(
        way[1:11], T_BASE_CAMERA, ORIGIN, CERTAIN))
    np.testing.assert_allclose(found[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-12)


def test_a_camera_that_moves_on_the_base_does_not_move_the_base():
    """The camera pans and sways on a base that drives: of both only the driving is seen."""
    placed, start = se3.exp([4, -2, 1, 0.3, 0.2, 1.5]), se3.exp([0, 0, 0, 0, 0, 0.05])
    base, T_base, T_placed_base = Camera(ORIGIN, CERTAIN), np.eye(4), np.eye(4)
    for i in range(10):
        sway = se3.exp([0.01 * i, 0.0, 0.02 * i, 0.0, 0.1 * i, 0.0])
        T_base_camera = T_BASE_CAMERA @ sway @ start
        T_visual_camera = se3.inverse(T_BASE_CAMERA @ start) @ T_base @ T_base_camera
        found, _ = base.follow(T_visual_camera, CERTAIN, T_base_camera, mount=Mount.MOVING)
        np.testing.assert_allclose(found, T_placed_base @ T_base, atol=1e-9)
        if i == 4:  # it is put elsewhere while the camera moves
            base.put(placed, CERTAIN)
            T_placed_base = placed @ se3.inverse(T_base)
        T_base = T_base @ se3.exp([0.1, 0.02, 0.0, 0.0, 0.0, 0.1])


def test_placed_it_goes_on_from_there_with_that_covariance(way):
    placed, placed_covariance = se3.exp([4, -2, 1, 0.3, 0.2, 1.5]), np.diag([1, 2, 3, 4, 5, 6.0])
    base = Camera(ORIGIN, CERTAIN)
    for T, S, *_ in way[:6]:
        base.follow(T, S, T_BASE_CAMERA)
    base.put(placed, placed_covariance)
    np.testing.assert_array_equal(base.base.pose.matrix, placed)
    for T, S, *_ in way[6:]:
        found = base.follow(T, S, T_BASE_CAMERA)
    expected = accumulate(way[6:], T_BASE_CAMERA, placed, placed_covariance)
    np.testing.assert_allclose(found[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-12)


def test_it_starts_at_the_given_pose(way):
    placed = se3.exp([4, -2, 1, 0.3, 0.2, 1.5])
    base = Camera(placed, CERTAIN)
    np.testing.assert_allclose(base.follow(*way[0][:2], T_BASE_CAMERA)[0], placed, atol=1e-12)
    found, _ = base.follow(*way[9][:2], T_BASE_CAMERA)
    expected, _ = accumulate(way[1:10], T_BASE_CAMERA, placed, CERTAIN)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_placed_while_blind_it_stays_until_the_next_pose_of_the_camera(way):
    base = Camera(ORIGIN, CERTAIN)
    for T, S, *_ in way:
        before = base.follow(T, S, T_BASE_CAMERA)
    base.put(*before, True)
    after = base.follow(ORIGIN, CERTAIN, T_BASE_CAMERA)
    np.testing.assert_allclose(after[0], before[0], atol=1e-12)
    np.testing.assert_allclose(after[1], before[1], atol=1e-12)


def test_placed_while_lost_it_stays_there_until_the_next_pose_of_the_camera(way):
    placed, placed_covariance = se3.exp([4, -2, 1, 0.3, 0.2, 1.5]), np.diag([1, 2, 3, 4, 5, 6.0])
    base = Camera(ORIGIN, CERTAIN)
    for T, S, *_ in way[:6]:
        base.follow(T, S, T_BASE_CAMERA)
    base.update(*way[8][:2], status=Status.TOO_FEW_MATCHES)
    base.put(placed, placed_covariance)
    for T, S, *_ in way[12:]:
        found = base.follow(T, S, CORRECTED)
    expected = accumulate(way[13:], CORRECTED, placed, placed_covariance)
    np.testing.assert_allclose(found[0], expected[0], atol=1e-12)
    np.testing.assert_allclose(found[1], expected[1], atol=1e-12)


@pytest.mark.parametrize('lost', [False, True])
def test_placed_while_predicted_the_correction_of_the_prediction_is_not_added(lost):
    """Wheels slip by 5 m and drive on by 1 m; then the camera is found where it was lost."""
    camera, placed = Camera(), se3.exp([100, 0, 0, 0, 0, 0])
    camera.update()
    if lost:
        camera.update(**LOST)
    for forward in (2.0, 5.0):
        camera.update(se3.exp([0, 0, forward, 0, 0, 0]), predicted=True, **LOST)
    camera.put(placed, CERTAIN)
    driven = se3.exp([0, 0, 1.0, 0, 0, 0])
    camera.update(se3.exp([0, 0, 6.0, 0, 0, 0]), predicted=True, **LOST)
    there = placed @ T_BASE_CAMERA @ driven @ se3.inverse(T_BASE_CAMERA)
    np.testing.assert_allclose(camera.base.pose.matrix, there, atol=1e-12)
    np.testing.assert_allclose(camera.update(recovered=True).pose.matrix, there, atol=1e-12)
    np.testing.assert_allclose(camera.follow(driven)[0], there @ T_BASE_CAMERA @ driven
                               @ se3.inverse(T_BASE_CAMERA), atol=1e-12)


def test_the_covariance_is_that_of_sampled_errors():
    """Monte Carlo: camera poses with drawn errors, each carried to the base by itself."""
    rng = np.random.default_rng(8)
    placed = se3.exp([1, 2, 3, 0.4, -0.3, 0.8])
    root = np.diag([0.02, 0.01, 0.03, 0.02, 0.03, 0.01]) @ (
        np.eye(6) + 0.3 * rng.standard_normal((6, 6)))
    T_camera = se3.exp([0.5, -1.0, 2.0, 0.5, 0.3, -0.6])
    base = Camera(placed, CERTAIN)
    base.follow(ORIGIN, CERTAIN, T_BASE_CAMERA)
    T_base, covariance = base.follow(T_camera, root @ root.T, T_BASE_CAMERA)
    errors = []
    for delta in 0.1 * rng.standard_normal((20000, 6)) @ root.T:
        true = np.array(T_camera)
        true[:3, :3] = se3.exp_rotation(delta[3:]) @ T_camera[:3, :3]
        true[:3, 3] += delta[:3]
        moved = placed @ T_BASE_CAMERA @ true @ se3.inverse(T_BASE_CAMERA)
        errors.append(np.concatenate([
            moved[:3, 3] - T_base[:3, 3],
            se3.log_rotation(moved[:3, :3] @ T_base[:3, :3].T)]))
    sampled = np.cov(np.array(errors).T) / 0.1 ** 2
    np.testing.assert_allclose(sampled, covariance, atol=0.05 * np.abs(covariance).max())


def test_pose_and_twist_are_those_of_a_driving_robot():
    """The camera's path follows from the robot's by the extrinsic."""
    camera, T_odom_base, T_camera = Camera(), ORIGIN, ORIGIN
    step = se3.exp([0.03, 0.01, 0.0, 0.0, 0.02, 0.1])
    for i in range(5):
        T_odom_base = T_odom_base @ step
        seen = se3.inverse(T_BASE_CAMERA) @ T_odom_base @ T_BASE_CAMERA
        found = camera.update(seen, increment=moved_by(se3.inverse(T_camera) @ seen))
        T_camera = seen
        np.testing.assert_allclose(found.pose.matrix, T_odom_base, atol=1e-12)
        assert found.state is BaseState.TRACKED
        np.testing.assert_allclose(found.motion.twist, se3.log(step) * 1e9 / PERIOD, atol=1e-9)
        np.testing.assert_allclose(found.motion.T_before_now, step, atol=1e-9)


@pytest.mark.parametrize('mount', Mount)
def test_the_covariance_of_the_motion_is_that_of_sampled_errors(mount):
    """
    Monte Carlo about the axes of the base at the end of the increment, as REP-147 wants a twist.

    The camera of a moving mount has another extrinsic at each end.
    """
    rng = np.random.default_rng(11)
    T_base1_camera1 = CORRECTED if mount is Mount.MOVING else T_BASE_CAMERA
    T_camera0_camera1 = se3.exp([0.2, -0.1, 0.3, 0.5, -0.9, 0.4])
    root = np.diag([2, 1, 3, 4, 2, 6]) * 1e-3 @ (np.eye(6) + 0.3 * rng.standard_normal((6, 6)))
    camera = Camera()
    camera.update(mount=mount)
    found = camera.update(T_camera0_camera1, CERTAIN, T_base1_camera1, mount,
                          increment=moved_by(T_camera0_camera1, covariance=root @ root.T))
    T_base0_base1 = T_BASE_CAMERA @ T_camera0_camera1 @ se3.inverse(T_base1_camera1)
    errors = []
    for noise in rng.standard_normal((20000, 6)) @ root.T:
        true = (T_BASE_CAMERA @ se3.perturbed(T_camera0_camera1, noise)
                @ se3.inverse(T_base1_camera1))
        change = se3.inverse(T_base0_base1) @ true
        errors.append(np.r_[change[:3, 3], se3.log_rotation(change[:3, :3])])
    sampled = np.cov(np.array(errors).T)
    sigmas = np.sqrt(np.diag(sampled))
    for covariance in (found.motion.covariance,
                       found.motion.twist_covariance * (PERIOD / 1e9) ** 2):
        np.testing.assert_allclose(covariance / np.outer(sigmas, sigmas),
                                   sampled / np.outer(sigmas, sigmas), atol=0.04)


def test_the_motion_over_a_gap_is_known_where_the_camera_cannot_have_moved_on_the_base():
    """The extrinsic of an earlier frame is not kept."""
    for mount in Mount:
        camera = Camera()
        for _ in range(3):
            camera.update(mount=mount)
        found = camera.update(mount=mount, increment=moved_by(ORIGIN, back=2))
        assert (found.motion is None) == (mount is Mount.MOVING)


def test_over_a_gap_the_velocity_is_as_uncertain_as_it_may_have_changed_meanwhile():
    """A mean over 10 s is no velocity; over a frame it is. The increment is as certain in both."""
    settings = OdometrySettings(max_speed=2.0, max_turn_rate=3.0)
    camera, covariance = Camera(settings=settings), 1e-6 * np.eye(6)
    for back, change in ((1, 0.0), (9, 0.0), (300, [4, 4, 4, 9, 9, 9])):
        found = camera.update(increment=moved_by(ORIGIN, back, covariance)).motion
        own = found.covariance / found.interval ** 2
        np.testing.assert_allclose(np.diag(found.twist_covariance - own), change, atol=1e-12)
        np.testing.assert_allclose(
            found.covariance, PoseWithCovariance(ORIGIN, covariance).in_body(
                T_BASE_CAMERA).covariance, atol=1e-12)
    camera.base.configure(OdometrySettings(hold_time=60.0))
    held = camera.update(increment=moved_by(ORIGIN, 300, covariance)).motion
    np.testing.assert_allclose(held.twist_covariance, own, atol=1e-12)


def test_the_motion_over_images_that_repeat_begins_before_them():
    for mount in Mount:
        camera = Camera()
        camera.update(mount=mount)
        camera.update(mount=mount, status=Status.REPEATED, expected=moved_by(ORIGIN))
        assert camera.update(mount=mount, increment=moved_by(ORIGIN, back=2)).motion is not None


def swayed(number):
    """Return the extrinsic of a camera that is turned and moved on the base, by number."""
    return T_BASE_CAMERA @ se3.exp(number * np.array([0.02, 0.0, 0.01, 0.0, 0.1, 0.05]))


def test_the_motion_over_images_that_repeat_is_between_the_extrinsics_at_its_ends():
    camera, seen = Camera(), se3.exp([0.1, 0.0, 0.2, 0.1, 0.0, -0.1])
    camera.update(T_base_camera=swayed(0), mount=Mount.MOVING)
    for number, back in ((1, 1), (2, 2)):  # continued by what is expected since the first
        found = camera.update(status=Status.REPEATED, expected=moved_by(seen, back),
                              T_base_camera=swayed(number), mount=Mount.MOVING)
        np.testing.assert_allclose(found.motion.T_before_now, swayed(0) @ seen @ se3.inverse(
            swayed(number)), atol=1e-12)
        assert found.motion.interval == pytest.approx(back * PERIOD / 1e9)
    found = camera.update(increment=moved_by(seen, 3), T_base_camera=swayed(3),
                          mount=Mount.MOVING)
    np.testing.assert_allclose(found.motion.T_before_now, swayed(0) @ seen @ se3.inverse(
        swayed(3)), atol=1e-12)
    assert camera.update(increment=moved_by(seen, 2), mount=Mount.MOVING).motion is None


def test_an_increment_counts_before_what_was_expected():
    camera, seen, other = Camera(), se3.exp([0.1, 0, 0, 0, 0, 0]), se3.exp([0.5, 0, 0, 0, 0, 0])
    found = camera.update(increment=moved_by(seen), expected=moved_by(other))
    np.testing.assert_allclose(found.motion.T_before_now,
                               T_BASE_CAMERA @ seen @ se3.inverse(T_BASE_CAMERA), atol=1e-12)


@pytest.mark.parametrize('status', [Status.OK, Status.REPEATED])
def test_placed_after_a_frame_the_camera_is_where_it_was_on_the_base_then(status):
    """Also where that frame repeats another: it has moved the base, too."""
    camera, placed = Camera(), se3.exp([4, -2, 1, 0.3, 0.2, 1.5])
    camera.update(T_base_camera=swayed(0), mount=Mount.MOVING)
    there = se3.exp([0.3, 0.1, 0.0, 0.0, 0.0, 0.4])  # of the base, at rest from then on
    for number in (1, 2):
        camera.update(se3.inverse(swayed(0)) @ there @ swayed(number), status=status,
                      T_base_camera=swayed(number), mount=Mount.MOVING)
    camera.put(placed, CERTAIN)
    found, _ = camera.follow(se3.inverse(swayed(0)) @ there @ swayed(3),
                             T_base_camera=swayed(3), mount=Mount.MOVING)
    np.testing.assert_allclose(found, placed, atol=1e-12)


def test_a_correction_while_images_repeat_does_not_move_the_base(way):
    """Neither then nor with the next frame, and that goes on with the new extrinsic."""
    camera = Camera()
    for T, S, *_ in way[:6]:
        before, _ = camera.follow(T, S)
    found, _ = camera.follow(*way[5][:2], T_base_camera=CORRECTED, status=Status.REPEATED)
    np.testing.assert_allclose(found, before, atol=1e-12)
    found, covariance = camera.follow(*way[6][:2], T_base_camera=CORRECTED)
    expected = accumulate(way[6:7], CORRECTED, *accumulate(
        way[1:6], T_BASE_CAMERA, ORIGIN, CERTAIN))
    np.testing.assert_allclose(found, expected[0], atol=1e-12)
    np.testing.assert_allclose(covariance, expected[1], atol=1e-12)


@pytest.mark.parametrize('ends_by', ['a reset', 'a tracked frame'])
def test_placed_after_a_loss_the_motion_of_the_camera_is_added_again(ends_by):
    camera, placed = Camera(), se3.exp([4, -2, 1, 0.3, 0.2, 1.5])
    camera.update()
    camera.update(**LOST)
    if ends_by == 'a reset':
        camera.base.reset()
    else:
        camera.update(recovered=True)
    camera.put(placed, CERTAIN)
    step = se3.exp([0.2, 0.0, 0.1, 0.0, 0.3, 0.0])
    np.testing.assert_allclose(camera.follow(step)[0], accumulate(
        [(None, None, step, CERTAIN)], T_BASE_CAMERA, placed, CERTAIN)[0], atol=1e-12)


def test_after_a_reset_nothing_is_known_of_the_camera_before():
    camera, step = Camera(), se3.exp([0.2, 0.0, 0.1, 0.0, 0.3, 0.0])
    camera.update(step, T_base_camera=swayed(1), mount=Mount.MOVING)
    start = se3.exp([1.0, 2.0, 0.0, 0.0, 0.0, 0.5])
    camera.base.reset(PoseWithCovariance(start, np.eye(6)))
    np.testing.assert_array_equal(camera.base.pose.matrix, start)
    found = camera.update(increment=moved_by(step), T_base_camera=swayed(2), mount=Mount.MOVING)
    assert found.motion is None
    np.testing.assert_allclose(found.pose.matrix, start, atol=1e-12)


@pytest.mark.parametrize('is_blind', [True, False])
def test_placed_blind_before_the_first_frame_a_level_base_waits_for_the_camera(is_blind):
    camera, first, moved = Camera(), LEVEL @ T_BASE_CAMERA, se3.exp([0.3, 0, 0, 0, 0, 0.2])
    camera.put(se3.from_roll_pitch_yaw(0.0, 0.0, 2.0, (5, 6, 7)), CERTAIN, is_blind)
    found, _ = camera.follow(LEVEL @ moved @ T_BASE_CAMERA, level_start=first)
    level = se3.from_roll_pitch_yaw(0.1, -0.2, 2.0, (5, 6, 7))
    np.testing.assert_allclose(found, level if is_blind else level @ moved, atol=1e-12)


LOST, OK = {'status': Status.TOO_FEW_MATCHES}, {'increment': moved_by(ORIGIN)}


@pytest.mark.parametrize('values, state, moves, has_motion', [
    (OK, BaseState.TRACKED, True, True),
    ({'status': Status.FIRST_FRAME}, BaseState.TRACKED, True, False),
    ({'status': Status.REPEATED, 'expected': moved_by(ORIGIN)}, BaseState.CONTINUED, True, True),
    ({**OK, 'recovered': True}, BaseState.RECOVERED, True, False),
    ({**LOST, 'predicted': True}, BaseState.PREDICTED, True, False),
    (LOST, BaseState.LOST, False, False)])
def test_states(values, state, moves, has_motion):
    camera = Camera()
    camera.update()
    found = camera.update(se3.exp([1.0, 0, 0, 0, 0, 0]), **values)
    assert found.state is state
    assert found.stamp == camera.stamp
    assert np.linalg.norm(found.pose.translation) == pytest.approx(float(moves))
    assert (found.motion is not None) == has_motion
    np.testing.assert_array_equal(camera.base.pose.matrix, found.pose.matrix)
    np.testing.assert_array_equal(camera.base.pose.covariance, found.pose.covariance)


def test_a_stamp_that_is_not_newer_is_no_update():
    camera = Camera()
    assert camera.update(se3.exp([1.0, 0, 0, 0, 0, 0]), status=Status.BAD_STAMP) is None
    np.testing.assert_array_equal(camera.base.pose.matrix, ORIGIN)


def test_after_a_loss_the_motion_during_it_is_added():
    camera, away = Camera(), se3.exp([0.4, -0.2, 0.1, 0.1, 0.3, -0.2])
    camera.update()
    camera.update(**LOST)
    found = camera.update(away, recovered=True)
    np.testing.assert_allclose(found.pose.matrix,
                               T_BASE_CAMERA @ away @ se3.inverse(T_BASE_CAMERA), atol=1e-12)


def test_reset_begins_at_the_origin_with_the_next_pose_of_the_camera(way):
    camera = Camera(se3.exp([4, -2, 1, 0.3, 0.2, 1.5]))
    for T, S, *_ in way[:6]:
        camera.follow(T, S)
    camera.base.reset()
    for T, S, *_ in way[:9]:
        found, covariance = camera.follow(T, S, CORRECTED)
    expected = accumulate(way[1:9], CORRECTED, ORIGIN, CERTAIN)
    np.testing.assert_allclose(found, expected[0], atol=1e-12)
    np.testing.assert_allclose(covariance, expected[1], atol=1e-12)


LEVEL = se3.from_roll_pitch_yaw(0.1, -0.2, 0.7, (0.4, 0.5, 0.6))
"""Pose of the base in the level frame of the camera's odometry, at the start."""


def test_a_base_begins_with_roll_and_pitch_by_gravity_and_its_own_place_and_yaw(way):
    covariance = np.diag([1, 2, 3, 4, 5, 6.0])
    base = Camera(se3.from_roll_pitch_yaw(0.0, 0.0, 2.0, (5, 6, 7)), covariance)
    first = LEVEL @ T_BASE_CAMERA
    start, uncertainty = base.follow(first, level_start=first)
    level = se3.from_roll_pitch_yaw(0.1, -0.2, 2.0, (5, 6, 7))
    np.testing.assert_allclose(start, level, atol=1e-12)
    np.testing.assert_allclose(uncertainty, covariance, atol=1e-12)
    for pose, *_ in way[1:]:
        moved, _ = base.follow(first @ pose, level_start=first)
        in_base = T_BASE_CAMERA @ pose @ se3.inverse(T_BASE_CAMERA)
        np.testing.assert_allclose(moved, level @ in_base, atol=1e-12)


def test_a_base_that_is_not_seen_at_the_start_begins_there_all_the_same():
    base, first = Camera(), LEVEL @ T_BASE_CAMERA
    motion = se3.exp([0.3, 0.1, 0.0, 0.1, 0.0, 0.2])
    moved, _ = base.follow(LEVEL @ motion @ T_BASE_CAMERA, level_start=first)
    expected = se3.from_roll_pitch_yaw(0.1, -0.2, 0.0) @ motion
    np.testing.assert_allclose(moved, expected, atol=1e-12)


def test_a_camera_that_moves_on_the_base_before_that_is_seen_does_not_move_it():
    base, motion = Camera(), se3.exp([0.3, 0.1, 0.0, 0.1, 0.0, 0.2])
    base.base.mount(T_BASE_CAMERA)
    moved, _ = base.follow(LEVEL @ motion @ CORRECTED, T_base_camera=CORRECTED,
                           mount=Mount.MOVING, level_start=LEVEL @ T_BASE_CAMERA)
    expected = se3.from_roll_pitch_yaw(0.1, -0.2, 0.0) @ motion
    np.testing.assert_allclose(moved, expected, atol=1e-12)


def test_a_pose_that_is_set_later_is_kept_as_it_is():
    base, first = Camera(), LEVEL @ T_BASE_CAMERA
    base.follow(first, level_start=first)
    tilted = se3.from_roll_pitch_yaw(0.3, 0.2, 0.1, (1, 2, 3))
    base.put(tilted, CERTAIN)
    np.testing.assert_allclose(base.follow(first, level_start=first)[0], tilted, atol=1e-12)


def test_what_is_done_with_the_pose_of_one_base_does_not_move_another():
    BaseOdometry().pose.matrix[0, 3] = 5.0
    base = BaseOdometry()
    base.reset()
    base.pose.covariance[0, 0] = 5.0
    for pose in (BaseOdometry().pose, base.pose):
        np.testing.assert_array_equal(pose.matrix, ORIGIN)
        np.testing.assert_array_equal(pose.covariance, CERTAIN)


class Careless:
    """A base whose user overwrites all arrays that it has given and received."""

    def __init__(self, pose):
        own = pose.copy()
        self.base = BaseOdometry(own)
        overwrite(own)

    def reset(self, pose):
        own = pose.copy()
        self.base.reset(own)
        overwrite(own)

    def set_pose(self, pose):
        own = pose.copy()
        self.base.set_pose(own)
        overwrite(own)

    def update(self, update, T_base_camera, mount):
        update, T_base_camera = update.handed_over({}), T_base_camera.copy()
        found = self.base.update(update, T_base_camera, mount)
        result = found.pose.copy()
        overwrite(update.pose, found.pose, self.base.pose)
        T_base_camera[:] = np.nan
        if update.level_start is not None:
            update.level_start[:] = np.nan
        return result


def overwrite(*poses):
    for pose in poses:
        pose.matrix[:], pose.covariance[:] = np.nan, np.nan


@pytest.mark.parametrize('mount', Mount)
@pytest.mark.parametrize('level_start', [None, LEVEL @ T_BASE_CAMERA])
def test_arrays_that_were_given_or_returned_are_their_owners_to_change(way, mount, level_start):
    start = PoseWithCovariance(se3.exp([4, -2, 1, 0.3, 0.2, 1.5]), np.eye(6))
    careless, careful = Careless(start), BaseOdometry(start)
    for number, (T, S, *_) in enumerate(way):
        if number in (4, 8):
            for base in (careless, careful):
                (base.reset if number == 4 else base.set_pose)(start)
        status = (Status.TOO_FEW_MATCHES if number == 12 else
                  Status.REPEATED if number == 14 else Status.OK)
        arguments = OdometryUpdate(number, status, '', PoseWithCovariance(T, S), None,
                                   level_start=level_start), swayed(number // 3), mount
        found, expected = careless.update(*arguments), careful.update(*arguments).pose
        np.testing.assert_array_equal(found.matrix, expected.matrix)
        np.testing.assert_array_equal(found.covariance, expected.covariance)


def test_states_are_described_for_people():
    assert {state.name: state.value for state in (*BaseState, *Mount)} == {
        'TRACKED': 'measured', 'RECOVERED': 'measured again, from a pose that was not',
        'PREDICTED': 'predicted by another sensor',
        'CONTINUED': 'not measured, as the images repeat: continued',
        'LOST': 'not known: the pose is the last one',
        'FIXED': 'the extrinsic has been corrected', 'MOVING': 'the camera has been moved'}
