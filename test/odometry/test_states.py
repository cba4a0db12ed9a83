# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The states of the odometry by made-up registrations: right poses, and a script of failures."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry import Odometry
from aick_ros.odometry.increment_bias import IncrementBias
from aick_ros.odometry.keyframe import KeyframePolicy
from aick_ros.odometry.keyframe_memory import KeyframeMemory
from aick_ros.registration.preparation import Preparer
from aick_ros.registration.result import Evidence, Registration, SensorBias, failed
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

CAMERA = Camera(12, 10, 10.0, 10.0, 5.5, 4.5)
PERIOD = 0.1
COVARIANCE = np.diag([1e-6, 2e-6, 3e-6, 1e-7, 2e-7, 3e-7])
TWIST = np.array([0.3, -0.1, 0.2, 0.05, 0.1, -0.2])
START = 10 * NANOSECONDS


class Registrar:
    """
    Registers frames by their true poses.

    :ivar dark: stamps without matches; ``blind``: without depth; ``few``: with few keypoints.
    :ivar leaving: stamps of frames that show little of what was seen before.
    :ivar refused: pairs of stamps, source and target, that do not match.
    :ivar shapes: pairs of stamps, source and target, that were registered by depth alone;
        ``beside``: stamps and poses of other views in each of these.
    :ivar systematic: 6x6, added to the covariance of what differs from frame to frame.
    :ivar bias: between keypoints and depth, of all registrations.
    :ivar asked: what :meth:`register` was asked, stamps for frames, and the twist of the source.
    """

    refinements = 0

    def __init__(self, path):
        self.path, self.dark, self.blind, self.few = path, set(), set(), set()
        self.asked, self.unobserved, self.refused = [], [], set()
        self.leaving, self.shapes, self.beside = set(), [], []
        self.systematic, self.bias = np.zeros((6, 6)), None
        self.preparer = Preparer(Settings())

    def prepared(self, preparation, repeat=Repeat.NONE):
        frame = preparation.frame
        count = 5 if frame.stamp in self.few else 200
        keypoints = KeypointFrame(
            frame.stamp, np.full((count, 3), 2.0, np.float32), np.zeros((count, 32), np.uint8),
            np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)), np.zeros((count, 2), np.float32))
        return PreparedFrame(frame, keypoints, frame.grey, repeat=repeat)

    def prepared_like(self, target, source):
        return target

    def register(self, source, target, expected=None, tracked=None):
        self.asked.append((source.stamp, target.stamp, expected, source.twist))
        if self.dark & {source.stamp, target.stamp} or (
                source.stamp, target.stamp) in self.refused:
            return failed(Status.TOO_FEW_MATCHES, 'dark')
        return self._found(source, target, Evidence.KEYPOINTS)

    def register_colour(self, source, target, expected, is_followed):
        return failed(Status.TOO_FEW_MATCHES, 'dark')

    def register_depth(self, source, target, expected, unobserved, others):
        self.beside.append([(view.prepared.stamp, view.T_view_target) for view in others])
        self.unobserved.append((expected.covariance, unobserved))
        if self.blind & {source.stamp, target.stamp}:
            return failed(Status.TOO_FEW_KEYPOINTS, 'blind')
        self.shapes.append((source.stamp, target.stamp))
        return dataclasses.replace(self._found(source, target, Evidence.DEPTH_ALONE),
                                   overlap=0.55 if source.stamp in self.leaving else 0.9)

    def _found(self, source, target, evidence):
        T = se3.inverse(self.path(target.stamp)) @ self.path(source.stamp)
        return Registration(Status.OK, '', T, COVARIANCE + self.systematic,
                            np.empty((0, 2), np.intp), 1, 200, tracks='some', evidence=evidence,
                            systematic=self.systematic, bias=self.bias)


def at_constant_velocity(stamp):
    return se3.exp((stamp - START) / NANOSECONDS * TWIST)


@pytest.fixture
def made(monkeypatch, calibrated):
    """Return a function that makes an odometry with the registrar that it gets."""
    def make(path=at_constant_velocity, **values):
        registrar = Registrar(path)
        monkeypatch.setattr('aick_ros.odometry.odometry.Registrar', lambda *_: registrar)
        return Odometry(with_values(Settings(), {'sensor.depth_scale_sigma': 0.0, **{
            f'odometry.{name}': value for name, value in values.items()}})), registrar
    return make


def stamp_of(number):
    return START + round(number * PERIOD * NANOSECONDS)


def frame(number, images=None):
    """Return the frame of a number, with images of its own or those of another number."""
    rng = np.random.default_rng(number if images is None else images)
    return RgbdFrame(stamp_of(number), rng.integers(0, 255, (10, 12), np.uint8),
                     rng.uniform(1, 3, (10, 12)).astype(np.float32), CAMERA)


def test_a_frame_is_expected_where_the_velocity_leads(made):
    """Also in the frame of the keyframe, which is earlier than the last tracked one."""
    odometry, registrar = made()
    for number in range(5):
        odometry.register_frame(frame(number))
    source, target, expected, twist = registrar.asked[-1]
    assert (source, target) == (stamp_of(4), stamp_of(0))
    np.testing.assert_allclose(expected.T_target_source, at_constant_velocity(source), atol=1e-9)
    np.testing.assert_allclose(twist, TWIST, atol=1e-9)
    assert expected.elapsed == pytest.approx(PERIOD)


def test_the_time_since_the_velocity_was_confirmed_grows_in_the_dark(made):
    odometry, registrar = made()
    registrar.dark = {stamp_of(3), stamp_of(4)}
    for number in range(6):
        odometry.register_frame(frame(number))
    elapsed = {source: expected and expected.elapsed
               for source, _, expected, _ in registrar.asked}
    assert [elapsed[stamp_of(number)] for number in range(2, 6)] == pytest.approx(
        [PERIOD, PERIOD, 2 * PERIOD, 3 * PERIOD])


def test_in_the_dark_what_nothing_observes_is_as_uncertain_as_since_the_last_keypoints(made):
    """The motion expected is that of one step, the covariance that of all the time."""
    odometry, registrar = made(acceleration_sigma=2.0)
    registrar.dark = {stamp_of(3), stamp_of(4)}
    for number in range(5):
        odometry.register_frame(frame(number))
    for steps, (expected, unobserved) in zip((1, 2), registrar.unobserved):
        assert expected[0, 0] == pytest.approx((0.5 * 2.0 * PERIOD ** 2) ** 2)
        assert unobserved[0, 0] >= (0.5 * 2.0 * (steps * PERIOD) ** 2) ** 2
        assert unobserved[0, 0] == pytest.approx(
            (0.5 * 2.0 * (steps * PERIOD) ** 2) ** 2, rel=0.01)


def test_in_the_dark_frames_are_registered_to_one_depth_image_until_little_of_it_is_seen(made):
    odometry, registrar = made()
    registrar.dark = {stamp_of(number) for number in range(3, 8)}
    registrar.leaving = {stamp_of(5)}
    updates = [odometry.register_frame(frame(number)) for number in range(8)]
    assert registrar.shapes == [(stamp_of(number), stamp_of(shape)) for number, shape in (
        (3, 2), (4, 2), (5, 2), (6, 5), (7, 5))]
    for number in range(3, 8):
        increment = updates[number].increment
        assert increment.interval == pytest.approx(PERIOD)
        np.testing.assert_allclose(increment.pose.matrix, se3.exp(PERIOD * TWIST), atol=1e-9)


def test_in_the_dark_keyframes_and_earlier_shapes_are_known_beside_the_present_one(made):
    """Nearest first, where they truly are; and none of them once there are keypoints again."""
    odometry, registrar = made()
    registrar.dark = {stamp_of(number) for number in (*range(3, 10), 11, 12)}
    registrar.leaving = {stamp_of(5), stamp_of(7)}
    for number in range(13):
        odometry.register_frame(frame(number))
    stamps = [[stamp for stamp, _ in beside] for beside in registrar.beside]
    keyframe, *shapes = (stamp_of(number) for number in (0, 2, 5))
    in_order = [[keyframe]] * 3 + [[shapes[0], keyframe]] * 2 + [[*shapes[::-1], keyframe]] * 2
    assert stamps[:7] == in_order
    assert stamps[7:] == [[keyframe], [keyframe]]
    for (_, target), beside in zip(registrar.shapes, registrar.beside):
        for stamp, pose in beside:
            np.testing.assert_allclose(pose, se3.inverse(
                at_constant_velocity(stamp)) @ at_constant_velocity(target), atol=1e-9)


def test_in_the_dark_a_frame_has_the_velocity_that_depth_shows(made):
    """Of a camera that goes faster there; with keypoints its velocity is a filtered one."""
    def path(stamp):
        return at_constant_velocity(stamp + max(stamp - stamp_of(2), 0) // 2)

    for dark in (set(), {stamp_of(number) for number in range(3, 7)}):
        odometry, registrar = made(path)
        registrar.dark = dark
        updates = [odometry.register_frame(frame(number)) for number in range(7)]
        is_shown = [np.allclose(update.prepared.twist, update.increment.twist, atol=1e-9)
                    for update in updates[3:]]
        assert is_shown == 4 * [bool(dark)]


def test_a_frame_has_the_errors_of_its_velocity_from_the_third_increment_on(made):
    """As the camera is faster with each frame, but for the second one, by as much."""
    def path(stamp):
        elapsed = (stamp - START) / NANOSECONDS
        return se3.exp([2.0 * max(elapsed - PERIOD, 0.0) ** 2, 0, 0, 0, 0, 0])

    odometry, registrar = made(path)
    updates = [odometry.register_frame(frame(number)) for number in range(6)]
    known = [update.prepared.twist_variances for update in updates]
    assert known[:4] == 4 * [None]
    # a half of the change to the next interval, less a quarter of that to the one before
    speeds = np.diff([path(stamp_of(number))[0, 3] for number in range(5)]) / PERIOD
    changes = np.diff(speeds)
    error = 0.5 * changes[1] - 0.25 * changes[0]
    np.testing.assert_allclose(known[4], [1.4 * error ** 2, 0, 0, 0, 0, 0], rtol=1e-3, atol=1e-9)


def test_what_velocities_err_by_is_kept_at_a_reset_and_bounded_after_a_gap(made):
    settings = Settings().odometry
    odometry, registrar = made(lambda stamp: se3.exp([
        0.2 * ((stamp - START) / NANOSECONDS) ** 2, 0, 0, 0, 0, 0]))
    for number in range(5):
        update = odometry.register_frame(frame(number))
    known = update.prepared.twist_variances[0]
    long = round(3 * settings.hold_time / PERIOD)
    late = odometry.register_frame(frame(4 + long))
    assert late.increment.interval > 2 * settings.hold_time
    np.testing.assert_allclose(late.prepared.twist_variances[0],
                               known * (settings.hold_time / PERIOD) ** 2)
    odometry.reset()
    odometry.register_frame(frame(5 + long))
    assert odometry.register_frame(frame(6 + long)).prepared.twist_variances[0] > 0.0


def test_the_systematic_error_that_two_registrations_share_is_none_of_their_increment(made):
    odometry, registrar = made(lambda stamp: se3.exp([
        0.3 * (stamp - START) / NANOSECONDS, 0, 0, 0, 0, 0]))
    registrar.systematic = 1e-4 * np.eye(6)
    odometry.register_frame(frame(0))
    for number in range(1, 6):
        increment = odometry.register_frame(frame(number)).increment
        shown = registrar.systematic if number == 1 else 0.0
        np.testing.assert_allclose(increment.pose.covariance, COVARIANCE + shown, atol=2e-8)


def test_increments_have_the_bias_of_the_camera_which_is_kept_at_a_reset(made, monkeypatch):
    given, models = [], []

    class Told(IncrementBias):
        def __init__(self):
            models.append(self)

        def add_to(self, motion, shown, depth):
            given.append((motion, shown, depth))
            return PoseWithCovariance(motion.matrix, 7.0 * motion.covariance)

    monkeypatch.setattr('aick_ros.odometry.odometry.IncrementBias', Told)
    odometry, registrar = made()
    registrar.systematic = 1e-4 * np.eye(6)
    registrar.bias = SensorBias(
        np.full(6, 1e-4), 1e-8 * np.eye(6), 0.5 * np.eye(6), 1e-8 * np.eye(6))
    for numbers in (range(3), range(3, 6)):
        updates = [odometry.register_frame(frame(number)) for number in numbers]
        for update, (motion, _, depth) in zip(updates[1:], given):
            np.testing.assert_allclose(update.increment.pose.covariance, 7.0 * motion.covariance)
            assert depth == 2.0
        (first, shown, _), (second, between, _) = given
        assert shown is registrar.bias
        np.testing.assert_allclose(first.covariance, COVARIANCE, atol=1e-15)
        assert np.abs(between.difference).max() < 1e-5  # the same one twice
        np.testing.assert_allclose(second.covariance, COVARIANCE, atol=4e-8)
        given.clear()
        odometry.reset()
    assert len(models) == 1


def test_after_a_reset_there_is_no_velocity(made):
    odometry, registrar = made()
    for number in range(3):
        odometry.register_frame(frame(number))
    odometry.reset()
    for number in (3, 4):
        odometry.register_frame(frame(number))
    assert registrar.asked[-1][2] is None
    assert registrar.asked[-1][3] is None


def test_the_pose_of_an_image_that_repeats_has_the_error_of_the_velocity(made):
    """Its covariance is that of the motion model, and of the twist, by the square of the time."""
    odometry, registrar = made(acceleration_sigma=1.0, angular_acceleration_sigma=1.0)
    odometry.register_frame(frame(0))
    odometry.register_frame(frame(1))
    for ahead in (1, 2):
        update = odometry.register_frame(frame(1 + ahead, images=1))
        assert update.status is Status.REPEATED
        by_model = (0.5 * (ahead * PERIOD) ** 2) ** 2 * np.eye(6)
        np.testing.assert_allclose(update.expected.pose.covariance,
                                   by_model + ahead ** 2 * COVARIANCE, rtol=1e-9)
        np.testing.assert_allclose(update.T_odom_camera, at_constant_velocity(update.stamp),
                                   atol=1e-9)


def test_a_reset_begins_the_time_without_change_anew(made):
    """The first frame after it repeats no other; the time to rest counts from there."""
    odometry, registrar = made(hold_time=0.25)
    for number in range(8):
        odometry.register_frame(frame(number, images=0))
    odometry.reset()
    updates = [odometry.register_frame(frame(number, images=0)) for number in range(8, 11)]
    assert [update.status for update in updates] == [
        Status.FIRST_FRAME, Status.REPEATED, Status.REPEATED]


def test_the_increment_over_a_gap_is_no_velocity(made):
    """Found again by the keyframe, the velocity stays that from before the dark."""
    def path(stamp):  # the camera is turned round in the dark
        return se3.exp([0, 0, 0, 0, 0.5, 0]) @ at_constant_velocity(stamp) if (
            stamp > stamp_of(4)) else at_constant_velocity(stamp)
    odometry, registrar = made(path, max_turn_rate=10.0)
    registrar.dark = {stamp_of(3), stamp_of(4)}
    for number in range(7):
        odometry.register_frame(frame(number))
    expected = {source: expected for source, _, expected, _ in registrar.asked}
    turned = se3.inverse(path(stamp_of(5))) @ path(stamp_of(6))
    step = se3.inverse(path(stamp_of(0))) @ path(stamp_of(5)) @ turned
    np.testing.assert_allclose(expected[stamp_of(6)].T_target_source, step, atol=1e-6)


@pytest.mark.parametrize('least, is_reference', [(5, True), (6, False)])
def test_a_lost_frame_with_keypoints_enough_is_a_reference(made, least, is_reference):
    odometry, registrar = made(min_matches=least)
    registrar.few = {stamp_of(2)}
    registrar.dark = registrar.blind = {stamp_of(2), stamp_of(3)}
    for number in range(4):
        odometry.register_frame(frame(number))
    sought = {(source, target) for source, target, *_ in registrar.asked}
    assert ((stamp_of(3), stamp_of(2)) in sought) == is_reference


def test_a_lost_frame_of_few_keypoints_is_no_reference(made):
    odometry, registrar = made()
    registrar.few = {stamp_of(2)}
    registrar.dark = registrar.blind = {stamp_of(2), stamp_of(3)}
    for number in range(5):
        odometry.register_frame(frame(number))
    sought = {(source, target) for source, target, *_ in registrar.asked}
    assert (stamp_of(3), stamp_of(2)) not in sought
    assert (stamp_of(4), stamp_of(3)) not in sought  # found by the keyframe, which comes first
    registrar.dark = registrar.blind = {stamp_of(number) for number in (0, 4, 5, 6)}
    for number in (5, 6):
        odometry.register_frame(frame(number))
    sought = {(source, target) for source, target, *_ in registrar.asked}
    assert (stamp_of(6), stamp_of(5)) in sought


def test_a_keyframe_found_by_another_frame_than_the_one_before_has_the_error_of_both(
        made, monkeypatch):
    """It is no measurement from keyframe to keyframe: that covariance is added to the graph's."""
    detours, track = {}, KeyframeMemory.track

    def recorded(self, keyframe, T_reckoned_camera, detour, *others):
        detours[keyframe.stamp] = detour
        track(self, keyframe, T_reckoned_camera, detour, *others)

    monkeypatch.setattr(KeyframeMemory, 'track', recorded)
    monkeypatch.setattr(KeyframePolicy, 'advance', lambda self, prepared, found, sought, lost: (
        prepared.stamp not in (stamp_of(2), stamp_of(3))))
    odometry, registrar = made()
    registrar.refused = {(stamp_of(3), stamp_of(2))}
    for number in range(4):
        odometry.register_frame(frame(number))
    np.testing.assert_array_equal(detours[stamp_of(2)], np.zeros((6, 6)))
    np.testing.assert_array_equal(detours[stamp_of(3)], COVARIANCE)


def test_a_recording_that_starts_again_does_so_at_the_published_pose(made, monkeypatch):
    """Which a keyframe found again has moved away from that of the dead reckoning."""
    odometry, _ = made(motion_prior=False)
    for number in range(20, 23):
        odometry.register_frame(frame(number))
    moved = PoseWithCovariance(se3.exp([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]), np.eye(6))
    monkeypatch.setattr(KeyframeMemory, 'published', lambda *_: moved)
    odometry.register_frame(frame(0))
    monkeypatch.undo()
    update = odometry.register_frame(frame(1))
    assert update.status is Status.OK
    np.testing.assert_allclose(update.T_odom_camera, moved.matrix @ se3.exp(PERIOD * TWIST),
                               atol=1e-9)
