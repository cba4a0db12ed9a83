# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The order in which a frame is registered to its references, by made-up registrations."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.attempts import Attempts
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.inertial.accelerometer import Accelerometer
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.other_odometry import OtherOdometry
from aick_ros.odometry.reference import Reference, References
from aick_ros.odometry.velocity import Velocity
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

FOUND = Registration(Status.OK, '', np.eye(4), 1e-6 * np.eye(6), np.empty((0, 2), np.intp), 1,
                     support=100)


@dataclasses.dataclass(frozen=True)
class View:
    stamp: int
    sharpness: int = 1
    repeat: Repeat = Repeat.NONE
    surface: str = 'a room'
    twist: np.ndarray | None = None
    twist_variances: np.ndarray | None = None
    depth_lag: float = 0.0
    stamp_jitter: float | None = 0.0
    keypoints: range = range(300)
    grey: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((3, 4)))

    def is_blurred_beside(self, other):
        return self.sharpness < other.sharpness

    def bare(self):
        return self

    def moving(self, twist, variances=None):
        return dataclasses.replace(self, twist=twist, twist_variances=variances)


class Registrar:
    """Confirms by tracks what is not in doubt, and records what it was given."""

    def __init__(self, doubt=False):
        self._doubt = doubt
        self.by_keypoints, self.by_depth, self.followed = [], [], []

    def register(self, source, target, expected, tracked):
        assert tracked is None
        self.by_keypoints.append(expected)
        return dataclasses.replace(FOUND, tracks=None if self._doubt else 'some')

    def register_depth(self, source, target, expected, unobserved, others):
        assert others == ()
        self.by_depth.append((expected, unobserved))
        return dataclasses.replace(FOUND, evidence=Evidence.DEPTH_ALONE)

    def register_colour(self, source, target, expected, is_followed):
        self.by_keypoints.append(expected)
        self.followed.append(is_followed)
        return dataclasses.replace(FOUND, evidence=Evidence.COLOUR_ALONE)


def view(seconds, **values):
    return View(round(seconds * NANOSECONDS), **values)


def none_known(reference, T_reference_frame):
    """Return what is known beside a reference: nothing."""
    return ()


def attempts_by(registrar):
    """Return attempts without other sensors."""
    settings = Settings()
    gyroscope = Gyroscope(settings.imu, settings.odometry)
    expected = ExpectedMotion(settings.odometry, gyroscope, OtherOdometry(settings.odometry),
                              Accelerometer(
            Gravity(settings.imu), gyroscope, settings.imu, settings.odometry))
    return Attempts(settings, registrar, expected)


def order(now, references, doubt=False, twist=np.zeros(6)):
    """Return the evidence of all attempts in their order, with the times of the references."""
    attempts = attempts_by(Registrar(doubt)).of(
        now, references, Velocity(twist, confirmed=references.last.stamp), none_known)
    return [(attempt.registration.evidence, attempt.reference.stamp / NANOSECONDS)
            for attempt in attempts]


@pytest.fixture
def references():
    """Return a keyframe at 0 s and the last frame at 0.1 s."""
    first = Reference(view(0.0), PoseWithCovariance.identity())
    references = References(first)
    references.track(Reference(view(0.1), PoseWithCovariance.identity()), first)
    return references


BY_KEYPOINTS = [(Evidence.KEYPOINTS, 0.0), (Evidence.KEYPOINTS, 0.1)]
BY_COLOUR = [(Evidence.COLOUR_ALONE, 0.0)]
BY_DEPTH = [(Evidence.DEPTH_ALONE, 0.1)]


def test_keypoints_come_before_depth(references):
    assert order(view(0.2), references) == BY_KEYPOINTS + BY_DEPTH


@pytest.mark.parametrize('keypoints, limit', [
    (range(300), 0.3), (range(12), 0.3), (range(11), np.pi / 6.0), (range(0), np.pi / 6.0)])
def test_depth_alone_is_tried_as_long_as_the_motion_is_limited(references, keypoints, limit):
    """With keypoints, which fail, for the hold time; without until the camera may be turned."""
    for twist in (np.zeros(6), None):
        before, after = (view(0.1 + limit + margin, keypoints=keypoints)
                         for margin in (-0.01, 0.01))
        by_colour = BY_COLOUR if limit == 0.3 and len(keypoints) < 150 else []
        assert order(before, references, twist=twist) == BY_KEYPOINTS + by_colour + BY_DEPTH
        assert order(after, references, twist=twist) == BY_KEYPOINTS


@pytest.mark.parametrize('keypoints, is_tried', [(149, True), (150, False)])
def test_colour_alone_is_tried_where_depth_is_missing(references, keypoints, is_tried):
    """Where fewer keypoints have one than half of those of the keyframe, before depth alone."""
    by_colour = BY_COLOUR if is_tried else []
    now = view(0.2, keypoints=range(keypoints))
    assert order(now, references) == BY_KEYPOINTS + by_colour + BY_DEPTH
    assert order(now, references, doubt=True) == by_colour + BY_DEPTH + BY_KEYPOINTS
    assert order(now, references, twist=None) == BY_KEYPOINTS + by_colour + BY_DEPTH  # from rest


@pytest.mark.parametrize('elapsed, twist, is_tried', [
    (0.29, None, True), (0.31, None, False), (0.31, np.zeros(6), False)])
def test_by_colour_alone_a_camera_of_unknown_velocity_is_expected_to_rest(
        references, elapsed, twist, is_tried):
    """For the hold time."""
    registrar = Registrar()
    found = attempts_by(registrar).of(view(0.1 + elapsed, keypoints=range(0)), references,
                                      Velocity(twist), none_known)
    assert is_tried == any(
        attempt.registration.evidence is Evidence.COLOUR_ALONE for attempt in found)
    if is_tried:
        np.testing.assert_array_equal(registrar.by_keypoints[-1].T_target_source, np.eye(4))
        assert registrar.by_keypoints[-1].elapsed == pytest.approx(elapsed)


@pytest.mark.parametrize('is_lost', [False, True])
def test_colour_alone_knows_whether_the_frame_before_was_tracked(references, is_lost):
    references.is_lost, registrar = is_lost, Registrar()
    list(attempts_by(registrar).of(view(0.2, keypoints=range(0)), references,
                                   Velocity(np.zeros(6)), none_known))
    assert registrar.followed == [not is_lost]


def test_a_colour_image_that_repeats_shows_no_motion(references):
    now = view(0.2, keypoints=range(0), repeat=Repeat.COLOUR)
    assert order(now, references) == BY_DEPTH


def test_images_that_repeat_for_long_are_registered_by_depth_alone_too(references):
    now = view(9.0, keypoints=range(0), repeat=Repeat.BOTH)
    assert order(now, references, twist=None) == BY_KEYPOINTS + BY_DEPTH


@pytest.mark.parametrize('is_dark', [True, False])
def test_the_last_frame_lost_in_the_dark_is_a_depth_reference(references, is_dark):
    lost = Reference(view(5.0), PoseWithCovariance.identity())
    (references.lose_in_the_dark if is_dark else references.lose)(lost)
    found = order(view(5.1, keypoints=range(0)), references)
    others = [] if is_dark else [(Evidence.KEYPOINTS, 5.0)]
    assert found == BY_KEYPOINTS + others + is_dark * [(Evidence.DEPTH_ALONE, 5.0)]
    assert order(view(5.6, keypoints=range(0)), references) == BY_KEYPOINTS + others


@pytest.mark.parametrize('after, keypoints, support, is_recognised', [
    (0.53, 300, 35, False), (0.53, 300, 36, True), (0.52, 300, 12, True),
    (10.0, 300, 35, False), (10.0, 2000, 48, True), (10.0, 2000, 47, False)])
def test_a_place_is_told_by_enough_of_its_keypoints_where_nothing_else_tells_it(
        references, after, keypoints, support, is_recognised):
    """By 12 % of those sought, 400 at most, once the camera may have turned by half a turn."""
    assert Settings().odometry.max_turn_rate == 6.0  # rad/s: half a turn in 0.524 s
    registrar = Registrar()
    registrar.register = lambda *given: dataclasses.replace(FOUND, tracks='some', support=support)
    now = view(0.1 + after, keypoints=range(keypoints))
    for twist in (None, np.zeros(6)):  # which does not hold for so long
        *_, last = attempts_by(registrar).of(
            now, references, Velocity(twist), none_known)
        assert last.reference is references.last
        assert last.status is (Status.OK if is_recognised else Status.TOO_FEW_MATCHES)
        if not is_recognised:
            assert last.reason == (f'{support} of {min(keypoints, 400)} keypoints tracked, too '
                                   f'few to recognise the place after {after:.1f} s')


@pytest.mark.parametrize('along, about, is_recognised', [
    (0.049, 0.052, True), (0.051, 0.001, False), (0.001, 0.053, False)])
def test_a_place_is_recognised_by_a_pose_that_is_certain(references, along, about, is_recognised):
    """To 5 cm and 3 degrees in all directions; where the motion is known it may be less so."""
    variances = np.square([0.001, 0.001, along, 0.001, about, 0.001])
    registrar = Registrar()
    registrar.register = lambda *given: dataclasses.replace(
        FOUND, tracks='some', covariance=np.diag(variances))
    for twist, is_taken in ((None, is_recognised), (np.zeros(6), True)):
        found = next(attempts_by(registrar).of(view(0.2), references, Velocity(
            twist, confirmed=references.last.stamp), none_known))
        assert found.status is (Status.OK if is_taken else Status.TOO_FEW_MATCHES)
        assert ('too uncertain to recognise' in found.reason) != is_taken


def test_a_failure_or_a_pose_without_tracks_is_not_asked_for_its_keypoints(references):
    registrar = Registrar()
    for made in (failed(Status.TOO_FEW_MATCHES, 'as it was'),
                 dataclasses.replace(FOUND, tracks=None, support=13)):
        registrar.register = lambda *given: made
        *_, last = attempts_by(registrar).of(
            view(9.0), references, Velocity(), none_known)
        assert (last.status, last.reason) == (made.status, made.reason)


def test_a_pose_that_no_track_confirms_comes_after_depth(references):
    assert order(view(0.2), references, doubt=True) == BY_DEPTH + BY_KEYPOINTS


@pytest.mark.parametrize('now', [
    view(0.2, surface=None), view(0.2, grey=np.zeros((6, 8)))], ids=['no depth', 'resolution'])
def test_where_depth_or_tracks_cannot_know_better_nothing_is_doubted(references, now):
    assert order(now, references, doubt=True) == BY_KEYPOINTS + BY_DEPTH


def test_keypoints_of_a_colour_image_that_repeats_are_not_used(references):
    assert order(view(0.2, repeat=Repeat.COLOUR), references) == BY_DEPTH


def test_after_a_blur_the_keyframe_before_it_comes_first(references):
    blurred = Reference(view(0.15, sharpness=0), PoseWithCovariance.identity())
    references.track(blurred, blurred)
    assert order(view(0.2), references)[0] == (Evidence.KEYPOINTS, 0.0)
    assert order(view(0.2, sharpness=0), references)[0] == (Evidence.KEYPOINTS, 0.15)


@pytest.mark.parametrize('confirmed', [0.0, 0.1])
def test_registrations_know_the_motion_expected_and_the_time_since_keypoints_were_seen(confirmed):
    """A camera that turned and moved, at constant velocity since the last frame, 0.1 s ago."""
    keyframe, last = (
        PoseWithCovariance(se3.exp(twist), np.zeros((6, 6)))
        for twist in ([0.1, 0.2, 0.0, 0.0, 0.5, 0.1], [0.3, 0.1, 0.2, 0.1, 0.7, 0.0]))
    first = Reference(view(0.0), keyframe)
    references, registrar = References(first), Registrar()
    references.track(Reference(view(0.1), last), first)
    twist, settings = np.array([0.5, -0.2, 0.1, 0.3, 0.2, -0.4]), Settings().odometry
    list(attempts_by(registrar).of(
        view(0.2), references,
        Velocity(twist, confirmed=round(confirmed * NANOSECONDS), is_confirmed=True), none_known))
    moved = last.matrix @ se3.exp(0.1 * twist)
    for expected, reference in zip(registrar.by_keypoints, (keyframe, last)):
        assert expected.steady is None  # no other sensor has a part in the motion expected
        np.testing.assert_allclose(
            expected.T_target_source, np.linalg.inv(reference.matrix) @ moved, atol=1e-12)
        assert expected.elapsed == pytest.approx(0.2 - confirmed)
    (expected, unobserved), = registrar.by_depth
    np.testing.assert_allclose(expected.matrix, np.linalg.inv(last.matrix) @ moved, atol=1e-12)
    accelerations = np.repeat(
        [settings.acceleration_sigma, settings.angular_acceleration_sigma], 3)
    for covariance, interval in ((expected.covariance, 0.1), (unobserved, 0.2 - confirmed)):
        np.testing.assert_allclose(
            covariance, np.diag((accelerations * interval ** 2 / 2) ** 2), rtol=1e-9, atol=1e-12)


MOTION = PoseWithCovariance(se3.exp([0.1, -0.05, 0.2, 0.1, 0.3, -0.2]),
                            np.diag([1e-4, 4e-4, 9e-4, 1e-5, 4e-5, 9e-5]))
STEADY = PoseWithCovariance(se3.exp([0.2, 0.1, -0.1, 0.2, 0.1, 0.1]))
BLIND = PoseWithCovariance(se3.exp([0.7, 0, 0, 0, 0, 0]),
                           np.diag([9e-2, 4e-2, 1e-2, 9e-3, 4e-3, 1e-3]))
JOINED = dataclasses.replace(FOUND, T_target_source=se3.exp([0.02, 0.01, 0, 0, 0.01, 0]),
                             covariance=2e-6 * np.eye(6), reason='with the terms', support=80,
                             tracks='some')
SEEN = dataclasses.replace(FOUND, tracks='some')
RATE, TWIST = np.array([7.0, 8.0, 9.0]), np.arange(1.0, 7.0) / 10


class Expected:
    """Expects one motion with a twist, and another one without; notes what it is asked."""

    def __init__(self, is_known=True):
        self._is_known, self.asked = is_known, []

    def is_known(self, start, end, twist):
        self.asked.append(('is_known', start, end, twist))
        return self._is_known

    def between(self, start, end, twist):
        self.asked.append(('between', start, end, twist))
        return BLIND if twist is None else MOTION

    def steady(self, start, end, twist):
        return None if twist is None else STEADY

    def twist_at(self, stamp, twist):
        return np.r_[twist[:3], stamp / NANOSECONDS * RATE]

    def fused(self, seen, start, end):
        self.asked.append(('fused', seen, start, end))
        return dataclasses.replace(JOINED, tracks=seen.tracks) if seen.status.ok else seen


class Playing:
    """A registrar that plays one registration, and notes what it was given."""

    def __init__(self, found=SEEN):
        self.found, self.given = found, []

    def register(self, *given):
        self.given.append(given)
        return self.found

    register_depth = register

    def track(self, source, target, *given):
        self.given.append((source, target, *given))
        return dataclasses.replace(source, surface='tracked'), self.found


@pytest.fixture
def moved():
    """Return a keyframe at 0 s, and a last frame at 0.1 s elsewhere that is the shape, too."""
    first, last = (Reference(view(seconds), PoseWithCovariance(se3.exp(twist), np.zeros((6, 6))))
                   for seconds, twist in ((0.0, [0.1, 0.2, 0.0, 0.0, 0.5, 0.1]),
                                          (0.1, [0.3, 0.1, 0.2, 0.1, 0.7, 1.2])))
    references = References(first)
    references.track(last, first)
    return references


def stamp(seconds):
    return round(seconds * NANOSECONDS)


def test_a_frame_is_tracked_from_the_keyframe_with_its_velocity_and_expected_there(moved):
    expected, registrar = Expected(), Playing()
    tracked, attempt = Attempts(Settings(), registrar, expected).by_tracking(
        view(0.3), moved, Velocity(TWIST, confirmed=stamp(0.05), unsteadiness=np.arange(6.0)))
    assert expected.asked[:2] == [('is_known', stamp(0.1), stamp(0.3), TWIST),
                                  ('between', stamp(0.1), stamp(0.3), TWIST)]
    (source, target, pose), = registrar.given
    np.testing.assert_allclose(source.twist, np.r_[TWIST[:3], 0.3 * RATE])
    np.testing.assert_allclose(source.twist_variances, 0.2 ** 2 * np.arange(6.0))
    assert target is moved.keyframe.prepared and pose.elapsed == pytest.approx(0.25)
    for given, motion in ((pose.T_target_source, MOTION), (pose.steady, STEADY)):
        np.testing.assert_allclose(given, se3.inverse(
            moved.keyframe.pose.matrix) @ moved.last.pose.matrix @ motion.matrix, atol=1e-12)
    assert tracked.surface == 'tracked'
    assert attempt.reference is moved.keyframe
    assert attempt.increment.interval == pytest.approx(0.3)


def test_without_a_velocity_a_frame_is_tracked_where_another_sensor_knows_the_motion(moved):
    registrar = Playing()
    _, attempt = Attempts(Settings(), registrar, Expected()).by_tracking(
        view(0.3), moved, Velocity(confirmed=stamp(0.05)))
    (source, _, pose), = registrar.given
    assert source.twist is None and pose.steady is None and attempt.status is Status.OK
    np.testing.assert_allclose(pose.T_target_source, se3.inverse(
        moved.keyframe.pose.matrix) @ moved.last.pose.matrix @ BLIND.matrix, atol=1e-12)


def test_nothing_is_tracked_to_where_nothing_is_expected(moved):
    now = view(0.3)
    found, attempt = Attempts(Settings(), Playing(), Expected(False)).by_tracking(
        now, moved, Velocity(TWIST))
    assert found is now and attempt is None


@pytest.mark.parametrize('twist', [None, TWIST])
def test_a_frame_gets_the_velocity_that_is_known_of_it(moved, twist):
    """Where another sensor knows the motion, but not the velocity, depth alone has to tell it."""
    expected, registrar = Expected(), Playing()
    list(Attempts(Settings(), registrar, expected).of(
        view(0.3), moved, Velocity(twist), none_known))
    known = [source.twist for source, *_ in registrar.given]
    if twist is None:
        np.testing.assert_allclose(known.pop(), se3.log(SEEN.T_target_source) / 0.2)
        assert known == len(known) * [None]
    else:
        np.testing.assert_allclose(known, len(known) * [np.r_[TWIST[:3], 0.3 * RATE]])


def test_where_no_motion_is_known_nothing_is_expected(moved):
    registrar = Playing()
    list(Attempts(Settings(), registrar, Expected(False)).of(
        view(0.3), moved, Velocity(TWIST), none_known))
    by_keypoints, by_depth = registrar.given[:2], registrar.given[2:]
    assert [(source.twist, expected) for source, _, expected, *_ in by_keypoints] == (
        2 * [(None, None)])
    assert [source.twist for source, *_ in by_depth] == [None]


def test_what_is_expected_by_sensors_and_at_constant_velocity_is_in_each_reference(moved):
    registrar = Playing(failed(Status.TOO_FEW_MATCHES, ''))
    list(Attempts(Settings(), registrar, Expected()).of(
        view(0.3, repeat=Repeat.DEPTH), moved, Velocity(TWIST), none_known))
    for (_, _, expected, _), reference in zip(registrar.given, (moved.keyframe, moved.last)):
        for pose, motion in ((expected.T_target_source, MOTION), (expected.steady, STEADY)):
            np.testing.assert_allclose(pose, se3.inverse(
                reference.pose.matrix) @ moved.last.pose.matrix @ motion.matrix, atol=1e-12)


@pytest.mark.parametrize('jitter, error', [(0.001, 0.0033), (0.002, 0.005), (0.008, 0.008),
                                           (None, 0.0)])
def test_errors_of_stamps_count_by_the_velocity_that_is_expected(moved, jitter, error):
    """Those of three: of the ends, and twice of the one between both intervals."""
    registrar = Playing(failed(Status.TOO_FEW_MATCHES, ''))
    list(Attempts(Settings(), registrar, Expected()).of(
        dataclasses.replace(view(0.3, repeat=Repeat.DEPTH), stamp_jitter=jitter), moved,
        Velocity(TWIST), none_known))
    lengths = np.linalg.norm(TWIST.reshape(2, 3), axis=1)
    for _, _, expected, _ in registrar.given[:2]:
        np.testing.assert_allclose(expected.timing, np.sqrt(1 + 4 + 1) * error * lengths)


def test_a_rough_pose_that_was_tracked_is_one_in_the_keyframe(moved):
    registrar, rough = Playing(failed(Status.TOO_FEW_MATCHES, '')), se3.exp(TWIST)
    list(Attempts(Settings(), registrar, Expected()).of(
        view(0.3, repeat=Repeat.DEPTH), moved, Velocity(TWIST), none_known, rough))
    assert [given[1] for given in registrar.given[:2]] == [
        moved.keyframe.prepared, moved.last.prepared]
    assert [given[-1] is rough for given in registrar.given[:2]] == [True, False]


def test_by_depth_the_motion_and_what_nothing_observes_are_in_the_axes_of_the_reference(moved):
    """The latter since keypoints were seen, without a velocity."""
    shape = moved.keyframe
    moved.track_by_depth(moved.last, shape)
    expected, registrar = Expected(), Playing()
    attempts = Attempts(Settings(), registrar, expected)
    by_depth = list(attempts.of(view(0.3, repeat=Repeat.COLOUR), moved,
                                Velocity(TWIST, confirmed=stamp(0.02)), none_known))
    assert ('between', stamp(0.02), stamp(0.3), None) in expected.asked
    assert [attempt.reference for attempt in by_depth] == [shape, moved.last]
    for (_, target, motion, unobserved, _), reference in zip(
            registrar.given, (shape, moved.last)):
        assert target is reference.prepared
        T_reference_last = PoseWithCovariance(
            se3.inverse(reference.pose.matrix) @ moved.last.pose.matrix)
        since = T_reference_last @ MOTION
        np.testing.assert_allclose(motion.matrix, since.matrix, atol=1e-12)
        np.testing.assert_allclose(motion.covariance, since.covariance, atol=1e-12)
        blind = T_reference_last @ PoseWithCovariance(MOTION.matrix, BLIND.covariance)
        np.testing.assert_allclose(unobserved, blind.covariance, atol=1e-12)


@pytest.mark.parametrize('twist, is_confirmed, expected', [
    (TWIST, True, TWIST), (None, True, np.zeros(6)), (TWIST, False, None), (None, False, None)])
def test_where_no_surface_shows_the_motion_sensors_are_compared_with_the_velocity(
        moved, twist, is_confirmed, expected):
    asked = Expected()
    list(Attempts(Settings(), Playing(), asked).of(
        view(0.3, repeat=Repeat.COLOUR), moved,
        Velocity(twist, confirmed=stamp(0.02), is_confirmed=is_confirmed), none_known))
    (given,) = [given[3] for given in asked.asked if given[:2] == ('between', stamp(0.02))]
    np.testing.assert_array_equal(given, expected)


def test_by_depth_it_is_told_what_is_known_beside_each_reference(moved):
    shape, asked = moved.keyframe, []
    moved.track_by_depth(moved.last, shape)

    def views(reference, expected):
        asked.append((reference, expected))
        return [reference.stamp]
    registrar = Playing()
    list(Attempts(Settings(), registrar, Expected()).of(
        view(0.3, repeat=Repeat.COLOUR), moved,
        Velocity(TWIST, confirmed=stamp(0.02)), views))
    assert [reference for reference, _ in asked] == [shape, moved.last]
    for (_, _, motion, _, others), (reference, expected) in zip(registrar.given, asked):
        assert others == [reference.stamp] and expected is motion.matrix


def one_attempt(moved, found=SEEN, **changes):
    settings = with_values(Settings(), {
        f'odometry.{name}': value for name, value in changes.items()})
    expected = Expected()
    attempt = next(Attempts(settings, Playing(found), expected).of(
        view(0.5), moved, Velocity(TWIST), none_known))
    return attempt, [asked for asked in expected.asked if asked[0] == 'fused']


def test_an_attempt_has_what_the_images_show_and_that_with_the_terms_of_sensors(moved):
    attempt, fused = one_attempt(moved)
    assert fused == [('fused', SEEN, stamp(0.0), stamp(0.5))]
    assert attempt.seen is SEEN and attempt.registration.support == JOINED.support
    np.testing.assert_array_equal(attempt.increment.pose.matrix, JOINED.T_target_source)
    np.testing.assert_array_equal(attempt.increment.pose.covariance, JOINED.covariance)
    assert attempt.increment.interval == pytest.approx(0.5)
    assert (attempt.status, attempt.reason) == (Status.OK, 'with the terms')


@pytest.mark.parametrize('least, status', [
    (80, Status.OK), (81, Status.TOO_FEW_MATCHES)])
def test_an_attempt_needs_the_least_number_of_matches(moved, least, status):
    attempt, _ = one_attempt(moved, min_matches=least)
    assert attempt.status is status
    if status is not Status.OK:
        assert attempt.reason == '80 matches, odometry.min_matches is 81'


@pytest.mark.parametrize('evidence', [Evidence.DEPTH, Evidence.DEPTH_ALONE])
def test_what_depth_supports_needs_no_matches(moved, monkeypatch, evidence):
    monkeypatch.setitem(globals(), 'JOINED', dataclasses.replace(
        JOINED, support=0, evidence=evidence))
    assert one_attempt(moved)[0].status is Status.OK


def test_an_attempt_faster_than_the_gate_is_rejected(moved):
    """Two centimetres in half a second."""
    speed = np.linalg.norm(JOINED.T_target_source[:3, 3]) / 0.5
    for limit, status in ((1.01 * speed, Status.OK), (0.99 * speed, Status.MOTION_GATE)):
        attempt, _ = one_attempt(moved, max_speed=limit)
        assert attempt.status is status
    assert attempt.reason.startswith(f'{speed:.2f} m/s')


def test_what_failed_has_its_own_status_and_reason(moved):
    failure = failed(Status.DEGENERATE_GEOMETRY, 'on a line')
    attempt, _ = one_attempt(moved, failure)
    assert (attempt.status, attempt.reason) == (Status.DEGENERATE_GEOMETRY, 'on a line')
    assert attempt.seen is attempt.registration is failure


def test_what_no_track_confirms_and_a_check_rejects_is_no_doubt(moved):
    """It comes in its turn: only a pose that could be taken waits for that by depth."""
    orders = []
    for least in (80, 81):
        settings = with_values(Settings(), {'odometry.min_matches': least})
        attempts = Attempts(settings, Playing(FOUND), Expected()).of(
            view(0.5), moved, Velocity(TWIST), none_known)
        orders.append([attempt.reference.stamp for attempt in attempts])
    keyframe, last = moved.keyframe.stamp, moved.last.stamp
    assert orders == [[last, keyframe, last], [keyframe, last, last]]
