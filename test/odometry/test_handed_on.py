# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the odometry hands from one of its parts to the next while it tracks."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.effort import Effort
from aick_ros.odometry.increment_bias import IncrementBias
from aick_ros.odometry.reference import Reference
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.result import Evidence, SensorBias
from aick_ros.registration.status import Status
from aick_ros.registration.systematic_error import (
    errors_of_offset, errors_of_optics, errors_of_scale)
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

START = se3.exp([1.0, 2.0, 3.0, 0.3, -0.2, 0.5])
CAMERA = Camera(12, 10, 10.0, 10.0, 5.5, 4.5)  # of the frames of the fixtures
DARK = Evidence.DEPTH_ALONE


def assert_same(found, expected, atol=1e-12):
    np.testing.assert_allclose(found.matrix, expected.matrix, atol=atol)
    np.testing.assert_allclose(found.covariance, expected.covariance, atol=atol)


@pytest.fixture
def tracked(parts, steps, attempt_to):
    """Return the function that tracks frames 0.1 s apart by attempts, the first one the start."""
    def track(*attempts, **options):
        one = steps(T_odom_camera=START)
        one.take(0.0)
        for number, attempt in enumerate(attempts, 1):
            parts.attempts = [attempt]
            update = one.take(0.1 * number, **options)
        parts.attempt = parts.attempts[0](None, one.odometry._references)
        return one, update
    return track


def test_the_first_frame_is_where_it_is_told_and_begins_plane_and_memory(parts, steps):
    one = steps(T_odom_camera=START)
    update = one.take(0.0)
    assert (update.status, update.reason) == (Status.FIRST_FRAME, '40 keypoints')
    assert_same(update.pose, parts.published(PoseWithCovariance(START)))
    assert parts.asked('Gravity', 'begin') == []
    (plane,), = parts.asked('Plane', 'begin')
    np.testing.assert_array_equal(plane, START)
    (settings, registrar, first, fused), = parts.arguments('KeyframeMemory')
    assert settings is one.odometry._settings and registrar is one.odometry._registrar
    assert first.prepared is update.prepared
    np.testing.assert_array_equal(first.pose.matrix, START)
    assert_same(fused(first.pose), first.pose @ parts.fused)
    assert not first.pose.covariance.any() and first.in_keyframe is None
    assert update.level_start is not parts.start  # its own
    np.testing.assert_array_equal(update.level_start, parts.start)


@pytest.mark.parametrize('level, has_base', [(True, False), (True, True), (False, False)])
def test_without_a_pose_it_begins_level_unless_nothing_shows_or_needs_it(
        parts, steps, level, has_base):
    by_gravity = PoseWithCovariance(se3.exp([0, 0, 0, 0.3, 0.4, 0.0]))
    parts.answers['Gravity', 'begin'] = by_gravity if level else None
    one = steps()
    one.odometry._path.plane.has_base = has_base
    update = one.take(0.0)
    is_level = level and not has_base
    begin = by_gravity if is_level else PoseWithCovariance.identity()
    assert_same(update.pose, parts.published(begin))
    assert parts.asked('Gravity', 'begin') == ([] if has_base else [(update.stamp,)])
    np.testing.assert_array_equal(parts.asked('Plane', 'begin')[0][0], begin.matrix)


def test_once_placed_gravity_places_it_no_more(parts, steps):
    """Also after another recording has begun; a reset without a pose lets it."""
    one = steps()
    for seconds in (50.0, 1.0):
        assert one.take(seconds).status is Status.FIRST_FRAME
    assert len(parts.asked('Gravity', 'begin')) == 1
    one.odometry.reset()
    one.take(2.0)
    assert len(parts.asked('Gravity', 'begin')) == 2
    one.odometry.reset(START)
    one.take(3.0)
    assert len(parts.asked('Gravity', 'begin')) == 2


def test_a_recording_that_starts_again_begins_as_level_as_its_first_force_is(parts, steps):
    """Once, at the pose that was published last."""
    one, turned = steps(T_odom_camera=START), PoseWithCovariance(se3.exp([1, 2, 3, 0.3, 0.4, 0]))
    parts.answers['Gravity', 'begin_again'] = turned
    first = one.take(50.0)
    assert parts.asked('Gravity', 'begin_again') == []
    again = one.take(1.0)
    assert_same(again.pose, parts.published(turned))
    (stamp, pose), = parts.asked('Gravity', 'begin_again')
    assert stamp == again.stamp
    assert_same(pose, first.pose)


def test_where_no_force_is_known_a_recording_starts_again_at_the_pose_reached(parts, steps):
    one = steps(T_odom_camera=START)
    first, again = one.take(50.0), one.take(1.0)
    assert len(parts.asked('Gravity', 'begin_again')) == 1
    assert_same(again.pose, parts.published(first.pose))
    one.odometry.reset(START)
    one.take(0.5)
    assert len(parts.asked('Gravity', 'begin_again')) == 1


@pytest.mark.parametrize('count, is_enough', [(20, True), (19, False)])
def test_a_first_frame_needs_as_many_keypoints_as_matches(parts, steps, count, is_enough):
    one = steps(T_odom_camera=START)
    least = one.odometry._settings.odometry.min_matches
    parts.count = count - 20 + least
    update = one.take(0.0)
    if is_enough:
        assert update.status is Status.FIRST_FRAME
    else:
        assert update.status is Status.TOO_FEW_KEYPOINTS
        assert update.reason == (f'{least - 1} keypoints with depth, at least {least} are '
                                 'required')
        assert parts.arguments('KeyframeMemory') == parts.asked('Plane', 'begin') == []
        np.testing.assert_allclose(  # no memory corrects it yet
            update.T_odom_camera, parts.levelled @ START @ parts.held, atol=1e-12)


def test_what_a_frame_brings_reaches_its_parts_before_it_is_registered(parts, steps):
    one, mounted = steps(), se3.exp([0, 0, 1, 0, 0.5, 0])
    samples = ImuSamples(np.array([5, 6]), np.ones((2, 3)), np.ones((2, 3)))

    def predict(before, now):
        return None
    one.odometry.register_frame(one.frame(0.0, imu=samples), predict, mounted)
    asked = [(name, method) for name, method, _ in parts.log]
    first = asked.index(('Registrar', 'prepared'))
    assert [question for question in asked[:first] if question[1] in ('mount', 'begin', 'add')][
        -4:] == [('Plane', 'mount'), ('OtherOdometry', 'begin'), ('Gyroscope', 'add'),
                 ('Gravity', 'add')]
    assert parts.asked('Plane', 'mount')[-1][0] is mounted
    assert parts.asked('OtherOdometry', 'begin')[-1] == (predict,)
    assert parts.asked('Gyroscope', 'add') == [(samples,)]
    assert parts.asked('Gravity', 'add') == [(samples, 0.012, 'the mounting found')]
    one.take(0.1)
    assert len(parts.asked('Gyroscope', 'add')) == len(parts.asked('Gravity', 'add')) == 1
    assert parts.asked('Plane', 'mount')[-1] == (None,)


def test_an_extrinsic_that_is_rejected_leaves_the_prediction_before(parts, steps):
    def reject(pose):
        raise InputError('no pose')
    one = steps()
    parts.answers['Plane', 'mount'] = reject
    with pytest.raises(InputError):
        one.take(0.0)
    assert parts.asked('OtherOdometry', 'begin') == []


@pytest.mark.parametrize('given, named', [
    (lambda one: (None,), 'the preparation'),
    (lambda one: (one.odometry.prepare(one.frame(0.0)), np.eye(4)), 'predict')])
def test_arguments_of_another_kind_are_rejected_before_they_are_handed_on(
        parts, steps, given, named):
    one = steps()
    parts.log.clear()
    with pytest.raises(InputError, match=named):
        one.odometry.register(*given(one))
    assert parts.log == []


def test_a_pose_is_that_of_its_keyframe_with_the_registration(parts, tracked, attempt_to):
    """Published with what corrects it; who refers to it gets that of the image alone."""
    _, update = tracked(attempt_to())
    found = parts.attempt.registration
    pose = PoseWithCovariance(START) @ found.pose @ parts.fused
    assert_same(update.pose, parts.published(pose))
    references, last, attempt = parts.asked('KeyframeChoice', 'advance')[0]
    assert_same(last.pose, PoseWithCovariance(START) @ found.image_pose @ parts.fused)
    assert_same(last.in_keyframe, attempt.seen.unbiased_pose)
    assert last.prepared is update.prepared
    assert attempt.registration is found
    assert (update.status, update.reason, update.support, update.evidence, update.recovered) == (
        Status.OK, 'as told', 33, Evidence.KEYPOINTS, False)
    np.testing.assert_array_equal(update.matches, [[1, 2], [3, 4]])
    assert update.reference is references.keyframe.prepared.keypoints
    assert update.rejected is update.expected is None
    np.testing.assert_array_equal(update.level_start, parts.start)


def test_the_memory_advances_after_the_keyframe_was_chosen(parts, tracked, attempt_to):
    parts.answers['KeyframeChoice', 'advance'] = (
        lambda references, last, attempt: references.track(last, last))
    tracked(attempt_to())
    (_, last, _), = parts.asked('KeyframeChoice', 'advance')
    (keyframe, T_reckoned_camera, detour, _, effort), = parts.asked('KeyframeMemory', 'track')
    assert keyframe is last
    np.testing.assert_allclose(
        T_reckoned_camera, START @ parts.attempt.registration.T_target_source @ parts.fused,
        atol=1e-12)
    assert effort is Effort.LEAST and not detour.any()


@pytest.mark.parametrize('to, evidence, is_detour', [
    ('keyframe', Evidence.KEYPOINTS, False), ('last', Evidence.KEYPOINTS, True),
    ('last', DARK, False)])
def test_a_detour_is_a_registration_by_keypoints_to_another_frame(
        parts, tracked, attempt_to, to, evidence, is_detour):
    tracked(attempt_to(), attempt_to(to, evidence=evidence))
    *_, detour, _, effort = parts.asked('KeyframeMemory', 'track')[-1]
    assert effort is (Effort.LEAST if to == 'keyframe' else Effort.MORE)
    np.testing.assert_array_equal(
        detour, parts.attempt.registration.covariance if is_detour else np.zeros((6, 6)))


@pytest.mark.parametrize('refinements, effort', [(1, Effort.LEAST), (2, Effort.MUCH)])
def test_several_refinements_are_much_effort(parts, tracked, attempt_to, refinements, effort):
    """Those of the frame alone, though there were some before."""
    def refined(prepared, references):
        one.odometry._registrar.refinements += refinements
        return attempt_to()(prepared, references)

    one, _ = tracked(attempt_to())
    one.odometry._registrar.refinements = 7
    parts.attempts = [refined]
    one.take(0.2)
    assert [told[4] for told in parts.asked('KeyframeMemory', 'track')] == [Effort.LEAST, effort]


def test_the_gyroscope_learns_from_what_the_images_alone_show(parts, tracked, attempt_to):
    one, update = tracked(attempt_to(), attempt_to('last'))
    start, end, seen = parts.asked('Gyroscope', 'learn')[-1]
    assert (start, end) == (one.frame(0.1).stamp, update.stamp)
    assert_same(seen, parts.attempt.seen.pose)


def test_the_accelerometer_learns_from_poses_that_gravity_knows(parts, tracked, attempt_to):
    one, update = tracked(attempt_to(), attempt_to('last'))
    questions = [(part, method) for part, method, _ in parts.log]
    assert questions.index(('Gravity', 'update')) < questions.index(('Accelerometer', 'learn'))
    stamp, pose = parts.asked('Accelerometer', 'learn')[-1]
    assert stamp == update.stamp
    np.testing.assert_array_equal(pose, one.odometry._references.last.pose.matrix)


def test_by_depth_alone_no_sensor_and_no_filter_learns(parts, tracked, attempt_to):
    _, update = tracked(attempt_to(evidence=DARK))
    assert parts.asked('Gyroscope', 'learn') == parts.asked('PositionFilter', 'update') == []
    assert parts.asked('Accelerometer', 'learn') == []
    np.testing.assert_array_equal(update.prepared.twist[3:], parts.rate)
    np.testing.assert_allclose(update.prepared.twist[:3], update.increment.twist[:3])


def test_gravity_gets_the_measurement_and_the_correction(parts, tracked, attempt_to):
    _, update = tracked(attempt_to())
    stamp, reference, measured, T_odom_reckoned, corrected = parts.asked('Gravity', 'update')[0]
    assert stamp == update.stamp
    assert_same(reference, PoseWithCovariance(START))
    assert_same(measured, START @ parts.attempt.registration.pose)
    np.testing.assert_allclose(T_odom_reckoned, parts.corrected, atol=1e-12)
    assert_same(parts.levelled @ corrected @ parts.held, update.pose)


@pytest.mark.parametrize('is_known', [True, False])
def test_the_filter_measures_the_velocity_of_a_frame(parts, steps, attempt_to, is_known):
    """Of a position with the error of this registration alone; without it the increment does."""
    one, parts.attempts = steps(T_odom_camera=START), [attempt_to()]
    if not is_known:
        one.odometry._path._filter.velocity = None
    one.take(0.0)
    update = one.take(0.1)
    found = parts.attempts[0](None, one.odometry._references).registration
    (stamp, measured), = parts.asked('PositionFilter', 'update')
    assert stamp == update.stamp
    assert_same(measured, START @ found.pose)
    velocity = parts.velocity if is_known else update.increment.twist[:3]
    np.testing.assert_allclose(update.prepared.twist, np.r_[velocity, parts.rate])
    (asked, twist), = parts.asked('ExpectedMotion', 'twist_at')
    assert asked == update.stamp
    np.testing.assert_allclose(twist, update.increment.twist)


def test_an_increment_is_since_the_last_frame_with_the_terms_of_sensors(
        parts, tracked, attempt_to):
    one, update = tracked(attempt_to(), attempt_to())
    last = parts.asked('KeyframeChoice', 'advance')[0][1]
    seen, start, end = parts.asked('ExpectedMotion', 'fused_increment')[-1]
    assert (start, end) == (one.frame(0.1).stamp, update.stamp)
    assert_same(seen.pose, last.motion_to(parts.attempt.seen)[0])
    assert seen.interval == update.increment.interval == pytest.approx(0.1)
    assert_same(update.increment.pose, seen.pose @ parts.with_terms)


def test_an_increment_has_the_errors_of_its_two_stamps(parts, tracked, attempt_to):
    """Of 5 ms each along the motion, and of 25 ms in common by what the velocity changes."""
    parts.stamp_jitter = 0.004
    tracked(attempt_to(), attempt_to())
    last = parts.asked('KeyframeChoice', 'advance')[0][1]
    (before, *_), (seen, _, stamp) = parts.asked('ExpectedMotion', 'fused_increment')
    (shown, start, end, twist), = parts.asked('VelocityChange', 'squares')
    assert (start, end.stamp, shown.interval) == (last.prepared, stamp, seen.interval)
    np.testing.assert_allclose(
        twist, Increment(before.pose @ parts.with_terms, before.interval).twist)
    of_images = last.motion_to(parts.attempt.seen)[0].covariance
    velocity = se3.difference(seen.pose.matrix, np.eye(4)) / seen.interval
    np.testing.assert_allclose(
        seen.pose.covariance - of_images,
        2 * 0.005 ** 2 * np.outer(velocity, velocity)
        + 0.025 ** 2 / 3 * np.diag(parts.changes.repeat(3)), atol=1e-12)


def test_an_increment_has_the_error_of_a_readout_that_is_not_known(
        parts, tracked, attempt_to, monkeypatch):
    rng, first, second = np.random.default_rng(4), attempt_to(), attempt_to()

    def rolled(attempt, by_readout):
        return lambda *given: dataclasses.replace(attempt(*given), seen=dataclasses.replace(
            attempt(*given).seen, by_readout=by_readout))

    increments = []
    for sigma in (0.0, 0.012):
        monkeypatch.setattr(MisalignmentEstimate, 'readout_covariance', np.array([[sigma ** 2]]))
        tracked(*(rolled(each, by) for each, by in zip((first, second), rng.normal(size=(2, 6)))))
        increments += parts.asked('ExpectedMotion', 'fused_increment')[-2:]
    without, known = ([seen.pose.covariance for seen, *_ in each]
                      for each in (increments[:2], increments[2:]))
    last = parts.asked('KeyframeChoice', 'advance')[-2][1]
    by_first, by_second = last.by_readout, parts.attempt.seen.by_readout
    for added, by in zip(np.subtract(known, without), (
            by_first, last.readout_error(parts.attempt.seen))):
        np.testing.assert_allclose(added, 0.012 ** 2 * np.outer(by, by), atol=1e-15)
    assert not np.allclose(by_first, by_second)


def test_the_first_increment_has_the_errors_of_stamps_that_may_jitter(
        parts, tracked, attempt_to):
    """Two stamps show none, and one increment no change of the velocity."""
    parts.stamp_jitter, parts.unseen = None, np.square([0.03, 0.06])
    tracked(attempt_to())
    last = parts.asked('KeyframeChoice', 'advance')[0][0].keyframe
    (seen, *_), = parts.asked('ExpectedMotion', 'fused_increment')
    velocity = se3.difference(seen.pose.matrix, np.eye(4)) / seen.interval
    np.testing.assert_allclose(
        seen.pose.covariance - last.motion_to(parts.attempt.seen)[0].covariance,
        2 * 0.005 ** 2 * np.outer(velocity, velocity)
        + 0.025 ** 2 / 3 * np.diag(np.repeat([0.03 ** 2, 0.06 ** 2], 3)), atol=1e-12)


@pytest.mark.parametrize('evidence, shown, gain', [
    (Evidence.KEYPOINTS, np.diag([0.9, 0.8, 0.7, 0.3, 0.2, 0.1]), None),
    (Evidence.KEYPOINTS, None, np.zeros((6, 6))), (DARK, None, np.eye(6))])
def test_an_increment_has_the_errors_of_a_camera_that_may_be_misaligned(
        parts, tracked, attempt_to, monkeypatch, evidence, shown, gain):
    """By as much as it follows depth: wholly in the dark, and not by keypoints alone."""
    offset, optics = np.diag([4e-4, 1e-4, 2e-4, 1e-3, 2e-3, 1e-3]), np.diag([1e-3, 2e-3, 4e-3])
    monkeypatch.setattr(MisalignmentEstimate, 'offset_covariance', offset)
    monkeypatch.setattr(MisalignmentEstimate, 'optics_covariance', optics)
    bias = None if shown is None else SensorBias(
        np.zeros(6), 1e-8 * np.eye(6), shown, 1e-8 * np.eye(6))
    motion = PoseWithCovariance(se3.exp([0.1, 0.0, -0.1, 0.2, 0.1, -0.1]), 1e-8 * np.eye(6))
    monkeypatch.setattr(Reference, 'motion_to', lambda last, seen: (motion, bias))
    monkeypatch.setattr(IncrementBias, 'add_to', lambda bias, motion, shown, depth: motion)
    monkeypatch.setattr(IncrementBias, 'add_to_depth_alone', lambda bias, motion, depth: motion)
    _, update = tracked(attempt_to(), attempt_to(evidence=evidence))
    seen = (update.increment if evidence is DARK
            else parts.asked('ExpectedMotion', 'fused_increment')[-1][0])
    gain = shown if gain is None else gain
    np.testing.assert_allclose(
        seen.pose.covariance - motion.covariance,
        errors_of_offset(motion.matrix, offset, gain)
        + errors_of_optics(motion.matrix, optics, gain, CAMERA), atol=1e-15)


@pytest.mark.parametrize('to', ['keyframe', 'last'])
def test_an_increment_has_the_scale_error_of_depth(parts, steps, attempt_to, to):
    """Before other sensors are fused, which have none; also of a frame registered to another."""
    found, parts.attempts = [], [attempt_to(to)]
    for sigma in (0.0, 0.03):
        one = steps(with_values(Settings(), {'sensor.depth_scale_sigma': sigma}), START)
        one.take(0.0)
        update = one.take(0.1)
        found.append(parts.asked('ExpectedMotion', 'fused_increment')[-1][0].pose
                     if to == 'keyframe' else update.increment.pose)
    np.testing.assert_allclose(found[1].covariance - found[0].covariance,
                               errors_of_scale(found[0].translation, 0.03), atol=1e-15)


def test_registered_to_another_frame_the_increment_is_that_registration(
        parts, tracked, attempt_to):
    _, update = tracked(attempt_to(), attempt_to('last'))
    assert update.increment.interval == 0.123
    assert_same(update.increment.pose, parts.attempt.increment.pose)


@pytest.fixture
def by_depth(parts):
    """Let a frame by depth alone be registered to the last one, which is the shape from then."""
    def advance(references, last, attempt):
        if attempt.registration.is_by_depth:
            references.track_by_depth(last, attempt.reference)
        else:
            references.track(last, references.keyframe)
    parts.answers['KeyframeChoice', 'advance'] = advance


@pytest.mark.parametrize('to, is_to_shape', [('depth_reference', True), ('keyframe', False),
                                             ('last', False)])
def test_in_the_dark_an_increment_is_that_between_frames_of_one_shape(
        parts, by_depth, tracked, attempt_to, to, is_to_shape):
    """By depth it has the motion expected already: the bias of depth alone is added."""
    _, update = tracked(attempt_to(), attempt_to('last', evidence=DARK),
                        attempt_to(to, evidence=DARK))
    if is_to_shape:
        last = parts.asked('KeyframeChoice', 'advance')[1][1]
        assert_same(update.increment.pose, IncrementBias().add_to_depth_alone(
            last.motion_to(parts.attempt.seen)[0], last.prepared.scene_depth))
        assert update.increment.interval == pytest.approx(0.1)
    else:
        assert_same(update.increment.pose, parts.attempt.increment.pose)


def asked_of(parts):
    """Return the twist and the time of the last confirmation that the attempts were given."""
    _, _, velocity, *_ = parts.asked('Attempts', 'of')[-1]
    return velocity.twist, (velocity.confirmed - 100 * NANOSECONDS) / NANOSECONDS


def test_the_next_frame_is_expected_by_the_last_increment(parts, tracked, attempt_to):
    one, update = tracked(attempt_to())
    twist, confirmed = asked_of(parts)
    assert twist is None and confirmed == 0.0
    one.take(0.2)
    twist, confirmed = asked_of(parts)
    np.testing.assert_allclose(twist, update.increment.twist)
    assert confirmed == pytest.approx(0.1)


def test_in_the_dark_the_velocity_is_what_depth_observes_since_keypoints_did(
        parts, by_depth, tracked, attempt_to):
    one, update = tracked(attempt_to(), attempt_to('last', evidence=DARK),
                          attempt_to('depth_reference', evidence=DARK))
    increment, unconfirmed = parts.asked('MotionModel', 'observed_twist')[-1]
    assert_same(increment.pose, update.increment.pose)
    assert unconfirmed == pytest.approx(0.2)
    one.take(0.4)
    twist, confirmed = asked_of(parts)
    np.testing.assert_array_equal(twist, parts.observed)
    assert confirmed == pytest.approx(0.1)


def test_found_again_after_the_dark_the_velocity_stays_and_is_confirmed(
        parts, by_depth, tracked, attempt_to):
    one, _ = tracked(attempt_to(), attempt_to('last', evidence=DARK), attempt_to())
    one.take(0.4)
    twist, confirmed = asked_of(parts)
    np.testing.assert_array_equal(twist, parts.observed)
    assert confirmed == pytest.approx(0.3)


def test_the_local_map_is_seen_from_the_pose_by_dead_reckoning(parts, tracked, attempt_to):
    one, _ = tracked(attempt_to())
    parts.answers['KeyframeMemory', 'keypoints_from'] = lambda pose: [pose]
    pose, = one.odometry.local_map()
    assert_same(pose, PoseWithCovariance(START) @ parts.attempt.registration.pose @ parts.fused)


def test_frames_are_prepared_by_the_preparer_of_the_registrar(parts, steps):
    one = steps()
    preparation = one.odometry.prepare(one.frame(0.0))
    assert preparation.preparer is one.odometry._registrar.preparer
    assert preparation.frame.stamp == one.frame(0.0).stamp
