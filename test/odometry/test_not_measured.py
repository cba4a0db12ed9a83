# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames that repeat, are late, are lost or may be tracked, by parts whose answers are known."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.result import Evidence
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

START = se3.exp([1.0, 2.0, 3.0, 0.3, -0.2, 0.5])
NANO = 1e-9  # s
LOST = [Status.TOO_FEW_MATCHES]


def assert_same(found, expected, atol=1e-12):
    np.testing.assert_allclose(found.matrix, expected.matrix, atol=atol)
    np.testing.assert_allclose(found.covariance, expected.covariance, atol=atol)


def statuses(updates):
    return [update.status for update in updates]


@pytest.fixture
def two(parts, steps, attempt_to):
    """Return an odometry after a first and a tracked frame, at 0 and 0.1 s, and the latter."""
    one, parts.attempts = steps(T_odom_camera=START), [attempt_to()]
    one.take(0.0)
    return one, one.take(0.1)


def last_pose(parts):
    return parts.asked('KeyframeChoice', 'advance')[-1][1].pose


@pytest.mark.parametrize('is_measured', [False, True])
def test_a_repeated_image_moves_on_from_the_last_pose_of_an_image(parts, two, is_measured):
    """Without another sensor with the error of the velocity, too: its variance by the time^2."""
    one, tracked = two
    parts.answers['ExpectedMotion', 'is_measured'] = is_measured
    update = one.take(0.3, images=0.1)
    assert (update.status, update.reason) == (Status.REPEATED, 'unchanged for 0.20 s')
    assert parts.asked('ExpectedMotion', 'without_images')[-1][:2] == (
        tracked.stamp, update.stamp)
    np.testing.assert_allclose(parts.asked('ExpectedMotion', 'without_images')[-1][2],
                               tracked.increment.twist)
    (start, end, twist), = parts.asked('ExpectedMotion', 'is_measured')
    assert (start, end) == (tracked.stamp, update.stamp)
    np.testing.assert_allclose(twist, tracked.increment.twist)
    covariance = parts.expected.covariance
    if not is_measured:
        covariance = covariance + (0.2 / 0.1) ** 2 * tracked.increment.pose.covariance
    motion = PoseWithCovariance(parts.expected.matrix, covariance)
    assert_same(update.expected.pose, motion)
    assert update.expected.interval == pytest.approx(0.2)
    assert_same(update.pose, parts.published(last_pose(parts) @ motion @ parts.fused))
    assert update.increment is update.rejected is None
    assert not update.predicted and not update.recovered
    assert update.prepared.repeat is Repeat.BOTH
    assert update.prepared.frame.stamp == update.keypoints.stamp == update.stamp
    assert len(update.keypoints) == len(tracked.keypoints)


def test_after_repeated_images_the_next_frame_is_registered_since_the_one_before_them(
        parts, two):
    one, tracked = two
    one.take(0.2, images=0.1)
    update = one.take(0.3)
    assert update.status is Status.OK and not update.recovered
    assert update.increment.interval == pytest.approx(0.2)
    assert_same(update.pose, parts.published(
        PoseWithCovariance(START) @ parts.attempts[0](
            None, one.odometry._references).registration.pose @ parts.fused))


@pytest.mark.parametrize('late, status', [(0, Status.REPEATED), (1, Status.OK)])
def test_images_that_do_not_change_for_longer_than_the_time_to_rest_are_registered(
        parts, two, late, status):
    one, tracked = two
    one.take(0.2, images=0.1)
    update = one.take(0.1 + parts.time_to_rest + late * NANO, images=0.1)
    assert update.status is status
    np.testing.assert_allclose(parts.asked('MotionModel', 'time_to_rest')[-1][0],
                               tracked.increment.twist)
    if status is Status.OK:
        assert update.prepared.repeat is Repeat.BOTH
        # as long as it rests its images have been unchanged since the first of them
        assert one.take(0.36, images=0.1).status is Status.OK


@pytest.mark.parametrize('is_at_rest, status', [(True, Status.OK), (False, Status.REPEATED)])
def test_another_sensor_knows_whether_images_that_do_not_change_are_rest(
        parts, two, is_at_rest, status):
    """It is asked for the whole time without a change."""
    one, tracked = two
    parts.by_wheels = se3.exp([0.1, 0, 0, 0, 0, 0])
    parts.answers['OtherOdometry', 'is_at_rest'] = is_at_rest
    assert one.take(0.2, images=0.1).status is Status.REPEATED
    assert parts.asked('OtherOdometry', 'is_at_rest') == []
    update = one.take(0.4, images=0.1)
    assert update.status is status
    assert (tracked.stamp, update.stamp) in parts.asked('OtherOdometry', 'motion')
    (motion,), = parts.asked('OtherOdometry', 'is_at_rest')
    assert motion is parts.by_wheels


@pytest.mark.parametrize('since', ['the first', 'the last'])
def test_images_that_do_not_change_are_no_rest_of_a_camera_that_an_imu_moves(parts, two, since):
    """It is asked for the whole time without a change, and since the last pose."""
    one, tracked = two
    rest = one.take(0.4, images=0.1)
    assert rest.status is Status.OK
    stamp = tracked.stamp if since == 'the first' else rest.stamp
    parts.answers['ExpectedMotion', 'is_moving'] = lambda start, end: start == stamp
    assert one.take(0.45, images=0.1).status is Status.REPEATED


@pytest.mark.parametrize('seconds, status', [
    (0.1, Status.BAD_STAMP), (0.1 - NANO, Status.BAD_STAMP), (0.1 - 1.0, Status.BAD_STAMP),
    (0.1 - 1.0 - NANO, Status.FIRST_FRAME), (0.1 + NANO, Status.REPEATED)])
def test_images_of_a_stamp_that_is_not_newer_do_not_repeat(parts, two, seconds, status):
    one, tracked = two
    update = one.take(seconds, images=0.1)
    assert update.status is status
    if status is Status.BAD_STAMP:
        assert update.reason == f'{0.1 - seconds:.6f} s before the last frame'
        assert_same(update.pose, tracked.pose)
        assert update.increment is update.expected is None


def test_after_a_repeated_frame_an_earlier_stamp_is_late(parts, two):
    one, _ = two
    one.take(0.2, images=0.1)
    assert one.take(0.15).status is Status.BAD_STAMP


def test_a_recording_that_starts_again_begins_where_the_last_frame_was_published(
        parts, two, attempt_to):
    one, tracked = two
    update = one.take(-2.0)
    assert update.status is Status.FIRST_FRAME and update.recovered
    assert_same(update.pose, parts.published(tracked.pose))
    restarts = [method for name, method, _ in parts.log if name == 'Gravity'].count('restart')
    assert restarts == 2  # at the start, and now
    for part, method in (('PositionFilter', 'reset'), ('KeyframeChoice', 'begin')):
        assert len(parts.asked(part, method)) == 2
    assert len(parts.asked('Gravity', 'reset')) == len(parts.asked('Plane', 'reset')) == 1
    # neither the velocity nor its error is that before
    held = one.take(-1.9, images=-2.0)
    assert parts.asked('ExpectedMotion', 'without_images')[-1][2] is None
    assert_same(held.expected.pose, parts.expected)


@pytest.mark.parametrize('pose', [None, START])
def test_a_reset_forgets_all_that_was_tracked(parts, two, pose):
    one, _ = two
    one.odometry.reset(pose)
    assert len(parts.asked('Gravity', 'reset')) == len(parts.asked('Plane', 'reset')) == 2
    assert len(parts.asked('PositionFilter', 'reset')) == 2
    assert len(parts.asked('KeyframeChoice', 'begin')) == 2
    assert one.odometry.local_map().shape == (0, 3)
    update = one.take(0.05, images=0.1)  # neither late nor a repetition
    assert update.status is Status.FIRST_FRAME and not update.recovered
    begin = np.eye(4) if pose is None else pose
    assert_same(update.pose, parts.published(PoseWithCovariance(begin)))
    held = one.take(0.15, images=0.1)
    assert parts.asked('ExpectedMotion', 'without_images')[-1][2] is None
    assert_same(held.expected.pose, parts.expected)


def test_a_frame_that_nothing_registers_is_where_it_is_expected(parts, two, attempt_to):
    """Its reason is that of the first attempt; the next frame finds it among the references."""
    one, tracked = two
    parts.attempts = [
        attempt_to(status=status, found=status, reason=reason) for status, reason in (
            (Status.TOO_FEW_MATCHES, 'first'), (Status.DEGENERATE_GEOMETRY, 'second'))]
    references = one.odometry._references
    last = references.last
    update = one.take(0.2)
    assert (update.status, update.reason) == (Status.TOO_FEW_MATCHES, 'first')
    pose = last.pose @ parts.expected @ parts.fused
    assert_same(update.pose, parts.published(pose))
    *stamps, twist = parts.asked('ExpectedMotion', 'without_images')[-1]
    assert stamps == [tracked.stamp, update.stamp]
    np.testing.assert_allclose(twist, tracked.increment.twist)
    *_, lost = references.candidates(update.prepared)
    assert lost.prepared is update.prepared
    assert_same(lost.pose, pose)
    assert update.increment is update.expected is update.rejected is None
    assert not update.predicted and references.last is last


def test_what_was_found_and_failed_a_check_is_reported(parts, two, attempt_to):
    one, _ = two
    parts.attempts = [attempt_to(status=Status.MOTION_GATE), attempt_to(status=Status.MOTION_GATE)]
    update = one.take(0.2)
    first = parts.attempts[0](None, one.odometry._references)
    assert update.status is Status.MOTION_GATE
    assert_same(update.rejected.pose, first.increment.pose)
    assert update.rejected.interval == first.increment.interval


@pytest.mark.parametrize('is_measured', [True, False])
def test_a_lost_frame_is_predicted_where_another_sensor_knows_the_motion(
        parts, two, attempt_to, is_measured):
    one, tracked = two
    parts.attempts = [attempt_to(status=Status.TOO_FEW_MATCHES)]
    parts.answers['ExpectedMotion', 'is_measured'] = is_measured
    update = one.take(0.2)
    assert update.predicted is is_measured
    (start, end, twist), = parts.asked('ExpectedMotion', 'is_measured')
    assert (start, end) == (tracked.stamp, update.stamp)
    np.testing.assert_allclose(twist, tracked.increment.twist)


def test_the_first_attempt_that_succeeds_is_the_last_one(parts, two, attempt_to):
    """And the first frame tracked after a loss has recovered; the next one has not."""
    one, _ = two
    tracking = parts.attempts
    parts.attempts = [attempt_to(status=Status.TOO_FEW_MATCHES)]
    assert not one.take(0.2).status.ok
    parts.attempts = [*parts.attempts, attempt_to('last'), *tracking]
    update = one.take(0.3)
    assert update.status is Status.OK and update.recovered
    assert update.increment.interval == 0.123
    assert not one.take(0.4).recovered


def test_while_lost_nothing_repeats(parts, two, attempt_to):
    one, _ = two
    tracking, parts.attempts = parts.attempts, [attempt_to(status=Status.TOO_FEW_MATCHES)]
    assert statuses([one.take(0.2), one.take(0.3, images=0.1), one.take(0.4, images=0.2)]) == (
        3 * [Status.TOO_FEW_MATCHES])
    parts.attempts = tracking
    update = one.take(0.5, images=0.1)
    assert update.status is Status.OK and update.prepared.repeat is Repeat.NONE


def with_colour_of(one, seconds, earlier):
    frame, before = one.frame(seconds), one.frame(earlier)
    return type(frame)(frame.stamp, before.colour, frame.depth, frame.camera)


def test_of_a_colour_image_that_repeats_depth_shows_the_motion_or_nothing_does(
        parts, two, attempt_to):
    one, tracked = two
    parts.attempts = [attempt_to(status=Status.TOO_FEW_MATCHES)]
    update = one.odometry.register_frame(with_colour_of(one, 0.2, 0.1))
    assert (update.status, update.reason) == (Status.REPEATED, 'depth does not show the motion')
    assert update.prepared.repeat is Repeat.COLOUR
    assert update.expected.interval == pytest.approx(0.1)
    parts.attempts = []
    update = one.odometry.register_frame(with_colour_of(one, 0.3, 0.1))
    assert update.status is Status.REPEATED
    # with a depth image of its own it is not unchanged: the time to rest begins there
    assert one.take(0.4, images=0.1).reason == 'unchanged for 0.10 s'


def every(steps, interval):
    return steps(with_values(Settings(), {
        'odometry.aick_interval': interval, 'sensor.depth_scale_sigma': 0.0}), START)


def tracking(parts):
    """Return the numbers of frames, tenths of a second, of which tracking was tried."""
    return [round((prepared.stamp - 100 * NANOSECONDS) / NANOSECONDS * 10)
            for prepared, *_ in parts.asked('Attempts', 'by_tracking')]


def checking(parts):
    """Return the numbers of frames, tenths of a second, that AICK has checked."""
    return [round((own.stamp - 100 * NANOSECONDS) / NANOSECONDS * 10)
            for own, *_ in parts.asked('Registrar', 'contradicts')]


def test_aick_checks_every_third_frame(parts, steps, attempt_to):
    one, parts.attempts, parts.tracked = every(steps, 3), [attempt_to()], attempt_to()
    updates = [one.take(0.1 * number) for number in range(9)]
    assert tracking(parts) == list(range(1, 9)) and checking(parts) == [3, 6]
    assert statuses(updates) == [Status.FIRST_FRAME] + 8 * [Status.OK]
    _, references, velocity = parts.asked('Attempts', 'by_tracking')[-1]
    assert references is one.odometry._references
    np.testing.assert_allclose(velocity.twist, updates[7].increment.twist)
    assert velocity.confirmed == updates[7].stamp
    assert all(update.prepared.is_tracked for update in updates[1:])
    found = parts.tracked(None, references).registration
    assert_same(updates[8].pose, parts.published(
        PoseWithCovariance(START) @ found.pose @ parts.fused))
    own, keyframe, pose = parts.asked('Registrar', 'contradicts')[-1]
    assert not own.is_tracked and keyframe is references.keyframe.prepared
    assert pose is parts.tracked(None, references).seen.T_target_source


def test_where_aick_contradicts_it_decides(parts, steps, attempt_to):
    """From there it is not due for as many frames."""
    one, parts.attempts, parts.tracked = every(steps, 3), [attempt_to()], attempt_to()
    parts.answers['Registrar', 'contradicts'] = lambda own, *_: round(
        own.stamp / NANOSECONDS * 10) == 1003
    updates = [one.take(0.1 * number) for number in range(7)]
    assert [update.prepared.is_tracked for update in updates[1:]] == [
        True, True, False, True, True, True]
    assert len(parts.asked('Registrar', 'with_own_keypoints')) == 2
    assert parts.asked('Registrar', 'prepared') == [parts.asked('Registrar', 'prepared')[0]]
    assert checking(parts) == [3, 6]


def test_aick_checks_each_keyframe(parts, steps, attempt_to):
    """From there it is not due for as many frames."""
    one, parts.attempts, parts.tracked = every(steps, 3), [attempt_to()], attempt_to()
    parts.answers['KeyframeChoice', 'replaces'] = lambda prepared, attempt: round(
        prepared.stamp / NANOSECONDS * 10) == 1002
    for number in range(8):
        one.take(0.1 * number)
    assert checking(parts) == [2, 5]
    assert {attempt.seen for _, attempt in parts.asked('KeyframeChoice', 'replaces')} == {
        attempt.seen for *_, attempt in parts.asked('KeyframeChoice', 'advance')}


@pytest.mark.parametrize('is_rough', [True, False])
def test_aick_is_told_of_a_rough_pose_that_was_tracked(parts, steps, attempt_to, is_rough):
    made, rough = attempt_to(status=Status.TOO_FEW_MATCHES), se3.exp([0.1, 0, 0, 0, 0, 0.1])

    def tracked(*given):
        failure = made(*given)
        return dataclasses.replace(failure, seen=dataclasses.replace(
            failure.seen, T_target_source=rough, is_rough=is_rough))

    one, parts.attempts, parts.tracked = every(steps, 3), [attempt_to()], tracked
    one.take(0.0)
    one.take(0.1)
    (*_, told), = parts.asked('Attempts', 'of')
    assert told is (rough if is_rough else None)


def test_a_frame_that_cannot_be_tracked_is_registered_with_keypoints_of_its_own(
        parts, steps, attempt_to):
    """From there AICK is not due for as many frames."""
    one, parts.attempts, parts.tracked = every(steps, 3), [attempt_to()], attempt_to()
    for number in range(2):
        one.take(0.1 * number)
    for failure in (None, attempt_to(status=Status.TOO_FEW_MATCHES)):
        parts.log.clear()
        parts.tracked = failure
        update = one.take(0.2 if failure is None else 0.3)
        assert update.status is Status.OK and not update.prepared.is_tracked
        assert parts.asked('Registrar', 'prepared') == []
        assert len(parts.asked('Registrar', 'with_own_keypoints')) == 1
    parts.tracked = attempt_to()
    parts.log.clear()
    for number in range(4, 8):
        one.take(0.1 * number)
    assert tracking(parts) == [4, 5, 6, 7] and checking(parts) == [6]


def test_a_stamp_that_is_late_does_not_put_off_aick(parts, steps, attempt_to):
    """As of a camera whose driver delivers each frame twice."""
    one, parts.attempts, parts.tracked = every(steps, 3), [attempt_to()], attempt_to()
    for number in range(7):
        one.take(0.1 * number)
        assert one.take(0.1 * number).status is Status.BAD_STAMP
    assert tracking(parts) == [1, 2, 3, 4, 5, 6] and checking(parts) == [3, 6]


def test_a_tracked_frame_begins_the_time_without_change(parts, steps, attempt_to):
    one, parts.attempts, parts.tracked = every(steps, 99), [attempt_to()], attempt_to()
    one.take(0.0)
    one.take(0.2)
    update = one.take(0.4, images=0.2)
    assert (update.status, update.reason) == (Status.REPEATED, 'unchanged for 0.20 s')
    assert one.take(0.15).status is Status.BAD_STAMP


@pytest.fixture
def long_tracked(parts, steps, attempt_to):
    """Return an odometry that tracks for long, after a first and a tracked frame."""
    one, parts.attempts, parts.tracked = every(steps, 99), [attempt_to()], attempt_to()
    one.take(0.0)
    one.take(0.1)
    parts.log.clear()
    return one


def test_frames_with_an_image_that_repeats_are_not_tracked(parts, long_tracked):
    long_tracked.odometry.register_frame(with_colour_of(long_tracked, 0.2, 0.1))
    assert tracking(parts) == []
    long_tracked.take(0.3)
    assert tracking(parts) == [3]


def test_a_lost_frame_is_found_by_aick(parts, long_tracked, attempt_to):
    parts.tracked = parts.attempts[0]
    found, parts.attempts = parts.attempts, [attempt_to(status=Status.TOO_FEW_MATCHES)]
    parts.tracked = None
    assert not long_tracked.take(0.2).status.ok
    parts.attempts, parts.tracked = found, found[0]
    parts.log.clear()
    assert long_tracked.take(0.3).recovered
    assert tracking(parts) == []
    long_tracked.take(0.4)
    assert tracking(parts) == [4]


def test_after_the_dark_aick_finds_the_keyframe(parts, long_tracked, attempt_to):
    references = long_tracked.odometry._references
    references.track_by_depth(references.last, references.last)
    assert long_tracked.take(0.2).status is Status.OK
    assert tracking(parts) == []
    assert long_tracked.take(0.3).status is Status.OK  # the shape is gone
    assert tracking(parts) == [3]


def test_a_blurred_keyframe_is_not_tracked(parts, long_tracked, monkeypatch):
    references = long_tracked.odometry._references
    monkeypatch.setattr(references, 'is_blurred', lambda: True)
    long_tracked.take(0.2)
    assert tracking(parts) == []


def test_a_depth_alone_frame_is_no_recovery_of_the_keyframe(parts, two, attempt_to):
    one, _ = two
    parts.attempts = [attempt_to('last', evidence=Evidence.DEPTH_ALONE)]
    update = one.take(0.2)
    assert update.evidence is Evidence.DEPTH_ALONE
    assert update.increment.interval == 0.123
