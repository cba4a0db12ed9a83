# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Expected motions of sensors that are played, against products and sums of information."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.pose_fusion import with_measurement
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.motion_term import POSITION, ROTATION, MotionTerm
from aick_ros.odometry.other_odometry import OtherOdometry
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings

SETTINGS = OdometrySettings()
TWIST = np.array([0.3, 0.1, -0.2, 0.2, -0.1, 0.3])
STEP = NANOSECONDS // 20
MOTION = se3.exp(TWIST * 0.05)
TURN_NOISE, SHIFT_NOISE = 1e-6 * np.eye(3), 1e-7 * np.eye(3)


def since(motion, start, end):
    """Return a motion, or the one back where the end is before the start."""
    return motion if start < end else se3.inverse(motion)


class Turns:
    """A gyroscope that measures one rotation, and keeps what it was asked for."""

    def __init__(self, motion=None, covariance=TURN_NOISE, rate=None):
        self._motion, self._covariance, self._rate = motion, covariance, rate
        self.asked = []

    def term(self, start, end, is_summed=False):
        self.asked.append((start, end, is_summed))
        return None if self._motion is None else MotionTerm(
            since(self._motion, start, end), ROTATION, self._covariance)

    def rate_at(self, stamp):
        self.asked.append(stamp)
        return self._rate


class Shifts:
    """An accelerometer that measures one displacement, and keeps what it was asked for."""

    def __init__(self, motion=None, covariance=SHIFT_NOISE):
        self._motion, self.covariance = motion, covariance
        self.asked, self.is_followed, self.until = [], True, None

    def term(self, start, end):
        self.asked.append((start, end))
        return None if self._motion is None else MotionTerm(
            self._motion, POSITION, self.covariance)

    def knows(self, start, end):
        return (self._motion is not None and self.is_followed
                and (self.until is None or end <= self.until))

    def known_until(self, start, end):
        known = end if self.until is None else min(end, self.until)
        return known if self._motion is not None and self.is_followed else start


def expected(turns=None, wheels=None, settings=SETTINGS, shifts=None):
    other = OtherOdometry(settings)
    if wheels is not None:
        other.begin(lambda before, now: since(wheels, before, now))
    return ExpectedMotion(settings, turns or Turns(), other, shifts or Shifts())


def seen_as(pose=MOTION, covariance=1e-4, **parts):
    return Registration(Status.OK, '', pose, covariance * np.eye(6), np.empty((0, 2), np.intp), 1,
                        **parts)


def assert_same(pose, other, tolerance=1e-12):
    np.testing.assert_allclose(pose.matrix, other.matrix, atol=tolerance)
    np.testing.assert_allclose(pose.covariance, other.covariance, rtol=1e-9, atol=tolerance)


def test_without_sensors_a_motion_is_that_of_constant_velocity():
    motion = expected().between(STEP, 2 * STEP, TWIST)
    assert_same(motion, MotionModel(SETTINGS).predict(TWIST, 0.05))
    assert_same(expected().without_images(STEP, 2 * STEP, TWIST), motion)


@pytest.mark.parametrize('twist, late, turns, wheels, known', [
    (TWIST, 0, False, None, True), (TWIST, 1, False, None, False), (None, 0, False, None, False),
    (None, 0, True, None, True), (TWIST, 1, True, None, True), (None, 0, False, MOTION, True)])
def test_a_motion_is_known_up_to_the_hold_time_or_by_a_sensor(twist, late, turns, wheels, known):
    end = round(SETTINGS.hold_time * NANOSECONDS) + late
    model = expected(Turns(MOTION if turns else None), wheels)
    assert model.is_known(0, end, twist) is known


@pytest.mark.parametrize('start, end', [(5, 5), (5, 4)])
def test_no_sensor_is_asked_for_a_time_that_does_not_pass(start, end):
    turns = Turns(MOTION)
    assert not expected(turns, MOTION).is_known(start, end, None)
    assert turns.asked == []


def test_a_measured_turn_replaces_the_rotation_and_its_information_is_added():
    """Where the disturbances of rotation and translation are independent, the latter stays."""
    turned = se3.exp([0, 0, 0, 0.012, -0.004, 0.02])
    motion = expected(Turns(turned)).between(0, STEP, TWIST)
    prior = MotionModel(SETTINGS).predict(TWIST, 0.05)
    np.testing.assert_allclose(motion.translation, prior.translation, atol=1e-12)
    np.testing.assert_allclose(motion.covariance[:3, :3], prior.covariance[:3, :3])
    information = (np.linalg.inv(prior.covariance[3:, 3:]) + np.linalg.inv(TURN_NOISE))
    np.testing.assert_allclose(np.linalg.inv(motion.covariance[3:, 3:]), information, rtol=1e-6)
    np.testing.assert_allclose(motion.rotation, turned[:3, :3], atol=1e-3)
    assert se3.angle(motion.rotation.T @ turned[:3, :3]) < \
        0.1 * se3.angle(prior.rotation.T @ turned[:3, :3])


SHIFTED = se3.exp([0.0162, 0.0043, -0.0117, 0, 0, 0])


@pytest.mark.parametrize('twist, late', [(TWIST, 0), (TWIST, 1), (None, 0)])
def test_a_measured_displacement_is_added_to_what_is_expected(twist, late):
    """Whether the velocity still holds, holds no more or is not known."""
    end = late + round(SETTINGS.hold_time * NANOSECONDS)
    shifts = Shifts(se3.exp([0.09, 0.03, -0.05, 0, 0, 0]))
    for method in ('between', 'without_images'):
        prior, motion = (getattr(expected(Turns(MOTION), shifts=each), method)(0, end, twist)
                         for each in (None, shifts))
        assert_same(motion, with_measurement(prior, shifts.term(0, end).T_target_source, POSITION,
                                             SHIFT_NOISE).pose)
        assert np.linalg.norm(motion.translation - [0.09, 0.03, -0.05]) < 1e-3


def test_a_displacement_that_disagrees_is_not_added():
    """As of an accelerometer that was knocked, beyond what the hand may accelerate."""
    for shift, is_added in ((0.02, True), (0.4, False)):
        shifts = Shifts(se3.exp([shift, 0, 0, 0, 0, 0]))
        prior, motion = (expected(shifts=each).without_images(0, 2 * STEP, TWIST)
                         for each in (None, shifts))
        assert bool(abs(motion.translation[0] - prior.translation[0]) > 1e-4) is is_added


@pytest.mark.parametrize('wheels, shift, measured', [
    (None, None, False), (MOTION, None, True), (None, SHIFTED, True), (MOTION, SHIFTED, True)])
def test_a_motion_is_measured_by_wheels_or_an_accelerometer(wheels, shift, measured):
    found = expected(wheels=wheels, shifts=Shifts(shift)).is_measured(0, STEP, TWIST)
    assert found is measured


@pytest.mark.parametrize('shift, measured', [(0.02, True), (0.4, False)])
def test_a_displacement_that_is_not_added_has_measured_nothing(shift, measured):
    shifts = Shifts(se3.exp([shift, 0, 0, 0, 0, 0]))
    assert expected(shifts=shifts).is_measured(0, 2 * STEP, TWIST) is measured


@pytest.mark.parametrize('turn, shift, sigma, is_moving', [
    (None, None, 0.001, False), (0.029, None, 0.001, False), (0.031, None, 0.001, True),
    (None, 0.029, 0.001, False), (None, 0.031, 0.001, True), (0.029, 0.029, 0.001, False),
    (0.031, None, 0.0076, True), (0.031, None, 0.0078, False), (None, 0.031, 0.0076, True),
    (None, 0.031, 0.0078, False)])
def test_an_imu_moves_by_some_centimetres_and_by_more_than_its_noise(
        turn, shift, sigma, is_moving):
    """Three values exceed 16.3 times their variances once in a thousand times."""
    turns = None if turn is None else se3.exp([0, 0, 0, turn, 0, 0])
    shifts = None if shift is None else se3.exp([shift, 0, 0, 0, 0, 0])
    noise = sigma ** 2 * np.eye(3)
    assert expected(Turns(turns, noise), MOTION, shifts=Shifts(shifts, noise)).is_moving(
        0, STEP) is is_moving


def test_wheels_that_spin_do_not_move_a_camera_whose_imu_knows_better():
    """Without the camera; what the IMU does not know to the end is left to the wheels."""
    shift, spinning = [0.012, 0.004, -0.01], se3.exp([0.5, 0, 0, 0, 0, 0])
    shifts = Shifts(se3.exp([*shift, 0, 0, 0]))
    model = expected(wheels=spinning, shifts=shifts)
    motion = model.without_images(0, STEP, TWIST)
    np.testing.assert_allclose(motion.translation, shift, atol=1e-3)
    assert_same(motion, expected(shifts=shifts).without_images(0, STEP, TWIST))
    shifts.is_followed = False
    motion = expected(wheels=spinning, shifts=shifts).without_images(0, STEP, TWIST)
    assert_same(motion, OtherOdometry(SETTINGS).with_slip(spinning))


def rolling(speed):
    """Return wheels that move a camera along x at some speed [m/s]."""
    other = OtherOdometry(SETTINGS)
    other.begin(lambda start, end: se3.exp([speed * seconds(start, end), 0, 0, 0, 0, 0]))
    return other


def test_wheels_go_on_from_where_a_displacement_ends():
    """The rotation is the gyroscope's, over all of the time, as its error is the same in it."""
    wheels, shifts, turns = rolling(0.5), Shifts(SHIFTED), Turns(MOTION)
    model = ExpectedMotion(SETTINGS, turns, wheels, shifts)
    shifts.until = STEP
    first, motion = (model.without_images(0, end, TWIST) for end in (STEP, 3 * STEP))
    assert_same(motion, turns.term(0, 3 * STEP).added_to(
        first @ wheels.with_slip(wheels.motion(STEP, 3 * STEP))).pose)


def test_what_wheels_slipped_by_does_not_return_with_a_displacement_that_is_less_exact():
    """Nor do they move the camera once they roll again; after the next frame they may."""
    wheels, shifts = rolling(10.0), Shifts(SHIFTED)
    model = ExpectedMotion(SETTINGS, Turns(), wheels, shifts)
    alone = expected(shifts=Shifts(SHIFTED, np.eye(3)))
    model.without_images(0, STEP, TWIST)
    shifts.covariance = np.eye(3)
    assert_same(model.without_images(0, 2 * STEP, TWIST),
                alone.without_images(0, 2 * STEP, TWIST))
    later = model.without_images(STEP, 2 * STEP, TWIST)
    assert later.translation[0] > 0.4


def test_wheels_that_nothing_but_a_displacement_contradicts_go_on():
    """That is nonsense where it contradicts all motions; and it does so each time it is asked."""
    wheels, shifts = rolling(0.5), Shifts(se3.exp([50.0, 0, 0, 0, 0, 0]))
    model = ExpectedMotion(SETTINGS, Turns(), wheels, shifts)
    for end in (STEP, STEP, 20 * STEP):
        assert_same(model.without_images(0, end, TWIST),
                    wheels.with_slip(wheels.motion(0, end)))
    assert wheels.slipped_since is None


def slipped():
    """Return wheels that have slipped since stamp 0, and the displacement that shows it."""
    wheels, shifts = rolling(10.0), Shifts(SHIFTED)
    ExpectedMotion(SETTINGS, Turns(), wheels, shifts).without_images(0, STEP, TWIST)
    assert wheels.slipped_since == 0
    return wheels, shifts


def test_where_wheels_that_slipped_do_not_go_on_the_displacement_stays():
    """As they have no motion from where it ends."""
    wheels, shifts = slipped()
    shifts.until = STEP
    wheels.begin(lambda start, end: None if start else se3.exp([1.0, 0, 0, 0, 0, 0]))
    motion = ExpectedMotion(SETTINGS, Turns(), wheels, shifts).without_images(0, 3 * STEP, TWIST)
    np.testing.assert_allclose(motion.translation, SHIFTED[:3, 3], atol=1e-3)


def test_begun_anew_wheels_have_not_slipped():
    wheels, shifts = slipped()
    wheels.restart()
    shifts.is_followed = False
    motion = ExpectedMotion(SETTINGS, Turns(), wheels, shifts).without_images(0, STEP, TWIST)
    assert_same(motion, wheels.with_slip(wheels.motion(0, STEP)))


def test_wheels_that_go_on_measure_the_motion():
    """Though they know nothing of the time before."""
    wheels, shifts = OtherOdometry(SETTINGS), Shifts(SHIFTED)
    wheels.begin(lambda start, end: se3.exp([0.1, 0, 0, 0, 0, 0]) if start else None)
    shifts.until = STEP
    assert ExpectedMotion(SETTINGS, Turns(), wheels, shifts).is_measured(0, 3 * STEP, TWIST)
    wheels.begin(lambda start, end: None)
    assert not ExpectedMotion(SETTINGS, Turns(), wheels, shifts).is_measured(0, 3 * STEP, TWIST)


def test_wheels_and_a_displacement_that_agree_count_together():
    shifts = Shifts(MOTION, 1e-6 * np.eye(3))
    motion = expected(wheels=MOTION, shifts=shifts).without_images(0, STEP, TWIST)
    wheels = OtherOdometry(SETTINGS).with_slip(MOTION).covariance[:3, :3]
    np.testing.assert_allclose(np.linalg.inv(motion.covariance[:3, :3]),
                               np.linalg.inv(wheels) + 1e6 * np.eye(3), rtol=1e-6)


def test_a_displacement_is_no_term_of_what_the_images_show():
    """It continues a velocity that the images before have shown, which would count again."""
    shifts = Shifts(SHIFTED)
    model = expected(Turns(MOTION), shifts=shifts)
    model.fused(seen_as(), 0, STEP)
    model.fused_increment(Increment(PoseWithCovariance(MOTION, 1e-6 * np.eye(6)), 0.05), 0, STEP)
    assert shifts.asked == []


def with_error(sigmas):
    """Return a turn that differs from MOTION by so many standard deviations about x."""
    prior = MotionModel(SETTINGS).predict(TWIST, 0.05)
    sigma = np.sqrt(prior.covariance[3, 3] + TURN_NOISE[0, 0])
    return se3.perturbed(prior.matrix, np.array([0, 0, 0, sigmas * sigma, 0, 0]))


@pytest.mark.parametrize('factor, is_used', [(0.99, True), (1.01, False)])
def test_a_sensor_that_disagrees_too_much_is_ignored(factor, is_used):
    """The limit is that of three squares."""
    turned = with_error(factor * np.sqrt(LARGEST_SQUARED_DISTANCES[3]))
    motion = expected(Turns(turned)).between(0, STEP, TWIST)
    prior = MotionModel(SETTINGS).predict(TWIST, 0.05)
    assert (se3.angle(motion.rotation.T @ prior.rotation) > 1e-3) == is_used
    assert (motion.covariance[3, 3] < prior.covariance[3, 3]) == is_used


def test_at_the_limit_a_sensor_is_used_and_beside_it_not(monkeypatch):
    """For the motion expected, for a registration and for an increment."""
    turned, seen = with_error(1.0), seen_as()
    prior, term = MotionModel(SETTINGS).predict(TWIST, 0.05), MotionTerm(
        turned, ROTATION, TURN_NOISE)
    increment, model = Increment(seen.pose, 0.05), expected(Turns(turned))
    for pose, fused in (
            (prior, lambda: model.between(0, STEP, TWIST)),
            (seen.pose, lambda: model.fused(seen, 0, STEP).pose),
            (seen.pose, lambda: model.fused_increment(increment, 0, STEP).pose)):
        limit = term.added_to(pose).squared_distance
        for largest, is_used in ((limit, True), (np.nextafter(limit, 0.0), False)):
            monkeypatch.setattr(
                'aick_ros.geometry.pose_fusion.LARGEST_SQUARED_DISTANCES', {3: largest})
            assert (fused().covariance[3, 3] < pose.covariance[3, 3]) == is_used


def test_past_the_hold_time_wheels_replace_the_velocity():
    late = round(SETTINGS.hold_time * NANOSECONDS) + 1
    other = OtherOdometry(SETTINGS)
    assert_same(expected(wheels=MOTION).between(0, late, TWIST), other.with_slip(MOTION))
    assert_same(expected(wheels=MOTION).between(0, STEP, None), other.with_slip(MOTION))


@pytest.mark.parametrize('turns, wheels', [(MOTION, None), (None, MOTION), (MOTION, MOTION)])
def test_beside_what_sensors_expect_there_is_the_motion_at_constant_velocity(turns, wheels):
    model, late = expected(Turns(turns), wheels), round(SETTINGS.hold_time * NANOSECONDS) + 1
    assert_same(model.steady(STEP, 2 * STEP, TWIST), MotionModel(SETTINGS).predict(TWIST, 0.05))
    assert model.steady(0, STEP, None) is None and model.steady(0, late, TWIST) is None


def test_without_sensors_the_motion_at_constant_velocity_is_what_is_expected_anyway():
    assert expected().steady(STEP, 2 * STEP, TWIST) is None


@pytest.mark.parametrize('sigmas', [0.5, 1000.0])
def test_without_images_wheels_move_and_the_gyroscope_turns(sigmas):
    """However much they disagree: there is nothing else."""
    turned = with_error(sigmas)
    motion = expected(Turns(turned), MOTION).without_images(0, STEP, TWIST)
    by_wheels = OtherOdometry(SETTINGS).with_slip(MOTION)
    term = MotionTerm(turned, ROTATION, TURN_NOISE)
    assert_same(motion, term.added_to(by_wheels).pose)


def test_a_turn_rate_that_is_measured_replaces_that_of_the_images():
    rate = np.array([1.0, 2.0, 3.0])
    turns = Turns(rate=rate)
    np.testing.assert_array_equal(expected(turns).twist_at(77, TWIST),
                                  np.concatenate([TWIST[:3], rate]))
    assert turns.asked == [77]
    assert expected().twist_at(77, TWIST) is TWIST


def test_a_registration_is_fused_with_both_sensors_and_their_noise_adds_up():
    turns = Turns(MOTION)
    fused = expected(turns, MOTION).fused(seen_as(), 0, STEP)
    assert turns.asked == [(0, STEP, True)]
    wheels = OtherOdometry(SETTINGS)
    wheels.begin(lambda before, now: MOTION)
    pose = MotionTerm(MOTION, ROTATION, TURN_NOISE).added_to(seen_as().pose).pose
    assert_same(fused.pose, wheels.term(0, STEP, is_summed=True).added_to(pose).pose)


@pytest.mark.parametrize('part', ['systematic', 'unusual', 'timing'])
def test_a_part_of_the_covariance_shrinks_as_the_error_it_stands_for(part):
    """The share that a sensor leaves of each error, measured by moving the pose."""
    root = 1e-3 * np.random.default_rng(3).standard_normal((6, 6))
    covariance = 1e-4 * np.eye(6) + root @ root.T
    seen = dataclasses.replace(seen_as(), covariance=covariance, **{part: root @ root.T})
    model = expected(Turns(MOTION, 1e-5 * np.eye(3)))
    fused, step = model.fused(seen, 0, STEP), 1e-5
    kept = np.column_stack([se3.difference(
        model.fused(dataclasses.replace(seen, T_target_source=se3.perturbed(MOTION, step * axis)),
                    0, STEP).T_target_source, fused.T_target_source) / step
        for axis in np.eye(6)])
    np.testing.assert_allclose(getattr(fused, part), kept @ root @ root.T @ kept.T, atol=1e-10)


def test_what_depth_alone_or_nothing_measured_is_not_fused_again():
    model = expected(Turns(MOTION), MOTION)
    for seen in (seen_as(evidence=Evidence.DEPTH_ALONE), failed(Status.TOO_FEW_MATCHES, '')):
        assert model.fused(seen, 0, STEP) is seen


def test_a_registration_against_a_sensor_that_disagrees_stays():
    far = se3.perturbed(MOTION, np.array([0, 0, 0, 0.3, 0, 0]))
    seen = seen_as()
    assert expected(Turns(far)).fused(seen, 0, STEP) is seen
    both = expected(Turns(far), MOTION).fused(seen, 0, STEP)  # wheels are fused all the same
    assert both.covariance[0, 0] < seen.covariance[0, 0]


def test_an_increment_is_fused_and_keeps_its_interval():
    turns = Turns(MOTION)
    seen = Increment(PoseWithCovariance(with_error(0.5), 1e-4 * np.eye(6)), 0.05)
    fused = expected(turns).fused_increment(seen, 0, STEP)
    assert fused.interval == 0.05 and turns.asked == [(0, STEP, False)]
    assert_same(fused.pose, MotionTerm(MOTION, ROTATION, TURN_NOISE).added_to(seen.pose).pose)
    far = se3.perturbed(MOTION, np.array([0, 0, 0, 0.3, 0, 0]))
    assert expected(Turns(far)).fused_increment(seen, 0, STEP) is seen


@pytest.mark.parametrize('start, end', [(STEP, 2 * STEP), (2 * STEP, STEP)])
def test_what_differs_from_the_motion_before_a_loss_is_in_doubt(start, end):
    """All of it, whichever way the time passes: the standard deviation along it is its length."""
    model, off = expected(), np.array([0.01, -0.02, 0.005, 0.01, 0.02, -0.03])
    steady = model.between(start, end, TWIST).matrix
    seen = seen_as(se3.perturbed(steady, off), unusual=1e-5 * np.eye(6))
    widened = model.with_alternative(seen, start, end, TWIST)
    for part, before in ((widened.covariance, seen.covariance), (widened.unusual, seen.unusual)):
        np.testing.assert_allclose(part - before, np.outer(off, off), rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(widened.T_target_source, seen.T_target_source)
    assert model.with_alternative(seen_as(steady), start, end, TWIST).covariance == pytest.approx(
        seen_as().covariance, abs=1e-12)


def test_past_the_hold_time_and_of_what_failed_there_is_no_doubt():
    late, seen = round(SETTINGS.hold_time * NANOSECONDS), seen_as()
    assert expected().with_alternative(seen, 0, late, TWIST) is not seen
    assert expected().with_alternative(seen, 0, late + 1, TWIST) is seen
    lost = failed(Status.TOO_FEW_MATCHES, '')
    assert expected().with_alternative(lost, 0, STEP, TWIST) is lost
