# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Displacements of a camera that is not seen, whose motion and whose errors are known."""

import copy
import dataclasses

import numpy as np
import pytest
from scipy import stats

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.displacement import Displacement, LastMeasured, Limits
from aick_ros.odometry.inertial.force_integral import ForceIntegral
from aick_ros.odometry.inertial.gravity_filter import GRAVITY, GravityFilter
from aick_ros.odometry.motion_term import ROTATION, MotionTerm
from aick_ros.settings import ImuSettings
from aick_ros.sources.synthetic.imu import ImuModel, SensorNoise, imu_samples

START, MS = 5 * NANOSECONDS, NANOSECONDS // 1000
SETTINGS = ImuSettings(accelerometer_bias_walk=0.0)
SIGMAS = np.repeat([0.01, 0.03, 0.02], 3)  # of velocity, gravity and bias [m/s, m/s^2]
TILT = 0.006  # rad; standard deviation of the orientation about each axis
PLACE = np.array([0.04, -0.02, 0.03])  # of the accelerometer in the camera [m]
EXACT = SensorNoise(0.0, 0.0, np.inf, 0.0)
LIMITS = Limits(0.3, 0.7)  # m, m/s
AXES = se3.exp_rotation([0.3, -0.8, 1.1])  # of the world in those of the estimate


def pose(stamp):
    """Return the pose of a hand-held camera."""
    time = (stamp - START) / NANOSECONDS
    return se3.exp([0.2 * time + 0.1 * np.sin(3 * time), 0.15 * np.sin(2 * time), -0.1 * time ** 2,
                    0.4 * np.sin(2 * time), -0.9 * time, 0.3 * np.sin(4 * time)])


def pose_of_imu(stamp):
    return pose(stamp) @ se3.exp([*PLACE, 0, 0, 0])


class Exact:
    """A gyroscope without errors."""

    covariance = 1e-16 * np.eye(3)

    def rotation(self, start, end):
        return pose(start)[:3, :3].T @ pose(end)[:3, :3]

    def term(self, start, end):
        return MotionTerm(se3.inverse(pose(start)) @ pose(end), ROTATION, self.covariance)


def forces(noise=EXACT, seed=0, offset=0):
    """Return what an accelerometer measures from before the start on, for a second and a half."""
    samples = imu_samples(pose_of_imu, START - 50 * MS, START + 1500 * MS,
                          ImuModel(EXACT, noise), np.random.default_rng(seed))
    integral = ForceIntegral()
    integral.add(samples.stamps + offset, samples.accelerations)
    return integral


def last_measured(settings=SETTINGS, **parts):
    """Return a frame at the start whose velocity and gravity are known."""
    rotation = AXES @ pose(START)[:3, :3]
    estimate = GravityFilter(settings, rotation.T @ AXES @ [0, 0, GRAVITY], np.eye(3),
                             PoseWithCovariance(np.eye(4)))
    before, after = (pose_of_imu(START + step)[:3, 3] for step in (-MS, MS))
    estimate.values[:] = 0.0
    estimate.values[3:6] = AXES @ (after - before) / (2 * MS / NANOSECONDS)
    estimate.values[6:9] = AXES @ [0, 0, GRAVITY]
    estimate.covariance[:] = 0.0
    estimate.covariance[range(3, 12), range(3, 12)] = SIGMAS ** 2
    at_imu = np.eye(4)
    at_imu[:3, :3] = rotation
    return dataclasses.replace(LastMeasured(
        START, estimate, PoseWithCovariance(at_imu), 0, PLACE), **parts)


def truth(end):
    return (se3.inverse(pose(START)) @ pose(end))[:3, 3]


@pytest.mark.parametrize('end', [1, 20, 33, 400, 1000])
def test_without_errors_it_is_the_true_one(end):
    term = Displacement(last_measured(), forces(), Exact(), LIMITS).term(START + end * MS)
    np.testing.assert_allclose(term.T_target_source[:3, 3], truth(START + end * MS), atol=5e-4)
    np.testing.assert_allclose(term.rows, np.eye(3, 6))


def test_its_covariance_is_that_of_the_filter_by_a_factor():
    once, thrice = (Displacement(last_measured(), forces(), Exact(), LIMITS, *factor).term(
        START + 400 * MS) for factor in ((), (9.0,)))
    np.testing.assert_allclose(thrice.covariance, 9.0 * once.covariance)
    np.testing.assert_array_equal(thrice.T_target_source, once.T_target_source)


def test_frames_on_the_way_change_nothing():
    """Each interval is followed once."""
    follows = Displacement(last_measured(), forces(), Exact(), LIMITS)
    for end in (33, 67, 100, 100, 400):
        by_frames = follows.term(START + end * MS)
    at_once = Displacement(last_measured(), forces(), Exact(), LIMITS).term(START + 400 * MS)
    np.testing.assert_allclose(by_frames.T_target_source[:3, 3], at_once.T_target_source[:3, 3],
                               atol=1e-4)
    np.testing.assert_allclose(by_frames.covariance, at_once.covariance, rtol=1e-3)


def with_errors(seed):
    """Return a frame whose values err as its covariance says, and forces with noise."""
    rng = np.random.default_rng([seed, 3])
    true = last_measured()
    tilt = TILT * rng.standard_normal(3)  # about the axes of the camera
    tilted = PoseWithCovariance(true.pose.matrix @ se3.exp(np.append(np.zeros(3), tilt)),
                                np.diag(np.repeat([0.0, TILT ** 2], 3)))
    estimate = copy.deepcopy(true.estimate)
    estimate.values[3:12] += SIGMAS * rng.standard_normal(9)
    noise = SensorNoise(np.hypot(SETTINGS.accelerometer_noise, 0.02), 0.0, np.inf, 0.0)
    return Displacement(dataclasses.replace(
        true, estimate=estimate, pose=tilted), forces(noise, seed), Exact(), LIMITS)


@pytest.mark.parametrize('end', [33, 300, 1000])
def test_it_errs_as_its_covariance_says(end):
    nees = []
    for seed in range(60):
        term = with_errors(seed).term(START + end * MS)
        error = term.T_target_source[:3, 3] - truth(START + end * MS)
        nees.append(error @ np.linalg.solve(term.covariance, error))
    low, high = stats.chi2.ppf([0.001, 0.999], 3 * len(nees)) / len(nees)
    assert low < np.mean(nees) < high


def test_what_the_rotation_may_be_wrong_by_turns_gravity():
    """By a half g t^2, about the axes of the last camera."""
    uncertain, end, arm = Exact(), START + 500 * MS, 0.5 * 0.5 ** 2 * GRAVITY
    uncertain.covariance = np.diag([0.01, 0.02, 0.03]) ** 2
    exact, found = (Displacement(last_measured(), forces(), gyroscope, LIMITS).term(end)
                    for gyroscope in (Exact(), uncertain))
    up = pose(START)[2, :3]  # in the axes of that camera
    by_tilt = arm * se3.skew(up) @ np.diag([0.01, 0.02, 0.03])
    np.testing.assert_allclose(found.covariance - exact.covariance, by_tilt @ by_tilt.T,
                               atol=1e-12)


def test_where_the_camera_was_is_no_error_of_its_displacement():
    last = last_measured()
    last.estimate.values[:3] = 5.0
    last.estimate.covariance[:3, :3] = np.eye(3)
    last.estimate.covariance[:3, 3:6] = last.estimate.covariance[3:6, :3] = 0.001 * np.eye(3)
    found, known = (Displacement(each, forces(), Exact(), LIMITS).term(START + 500 * MS)
                    for each in (last, last_measured()))
    np.testing.assert_allclose(found.T_target_source, known.T_target_source, atol=1e-12)
    np.testing.assert_allclose(found.covariance, known.covariance, atol=1e-15)
    assert last.estimate.values[0] == 5.0  # it goes on from there


def test_an_uncertain_place_of_the_accelerometer_counts_as_the_camera_turns():
    estimate = last_measured().estimate
    estimate.values[12:15] = PLACE
    estimate.covariance[range(12, 15), range(12, 15)] = 0.05 ** 2
    end = START + 500 * MS
    known = Displacement(last_measured(), forces(), Exact(), LIMITS).term(end)
    found = Displacement(last_measured(estimate=estimate, position=np.zeros(3)), forces(),
                         Exact(), LIMITS).term(end)
    np.testing.assert_allclose(found.T_target_source[:3, 3], known.T_target_source[:3, 3],
                               atol=1e-12)
    turned = Exact().rotation(START, end) - np.eye(3)
    np.testing.assert_allclose(found.covariance - known.covariance,
                               0.05 ** 2 * turned @ turned.T, atol=1e-12)


def test_forces_are_those_of_their_own_clock():
    late = Displacement(last_measured(offset=7 * MS), forces(offset=7 * MS), Exact(), LIMITS)
    end = START + 300 * MS
    np.testing.assert_allclose(late.term(end).T_target_source[:3, 3], truth(end), atol=3e-4)


def some_forces(*arrived):
    """Yield the integral of the samples up to some stamps, one after the other, and up to all."""
    every, growing, count = forces(), ForceIntegral(), 0
    for stamp in (*arrived, every.last):
        now = every._stamps.searchsorted(stamp, 'right')
        growing.add(every._stamps[count:now], every._forces[count:now])
        count = now
        yield growing


@pytest.mark.parametrize('arrived, known', [(260, True), (200, False)])
def test_it_waits_for_samples(arrived, known):
    """A term is not known without them, and is as if they had been there once they arrive."""
    arriving, end = some_forces(START + arrived * MS), START + 300 * MS
    follows = Displacement(last_measured(), next(arriving), Exact(), LIMITS)
    assert (follows.term(end) is not None) is known
    next(arriving)
    at_once = Displacement(last_measured(), forces(), Exact(), LIMITS).term(end + 33 * MS)
    np.testing.assert_allclose(follows.term(end + 33 * MS).T_target_source[:3, 3],
                               at_once.T_target_source[:3, 3], atol=2e-5)


def test_without_samples_it_stays_and_goes_on_once_they_arrive():
    arriving = some_forces(START + 300 * MS)
    follows = Displacement(last_measured(), next(arriving), Exact(), LIMITS)
    known = follows.term(START + 300 * MS)
    assert follows.is_followed
    later = follows.term(START + 600 * MS)
    assert not follows.is_followed
    np.testing.assert_array_equal(later.T_target_source, known.T_target_source)
    np.testing.assert_allclose(later.covariance - known.covariance,
                               (0.3 * LIMITS.speed_sigma) ** 2 * np.eye(3), atol=1e-12)
    next(arriving)
    found = follows.term(START + 700 * MS)
    assert follows.is_followed
    np.testing.assert_allclose(found.T_target_source[:3, 3], truth(START + 700 * MS), atol=5e-4)


@pytest.mark.parametrize('unknown', ['term', 'rotation'])
def test_without_a_gyroscope_it_is_not_known(unknown):
    gyroscope = Exact()
    setattr(gyroscope, unknown, lambda start, end: None)
    assert Displacement(last_measured(), forces(), gyroscope, LIMITS).term(START + 33 * MS) is None


def test_it_is_followed_until_it_is_not_known_any_more():
    """Then it stays, and a camera that moves as it may is somewhere beside."""
    last = last_measured()
    last.estimate.covariance *= 100
    follows, terms = Displacement(last, forces(), Exact(), LIMITS), []
    for end in range(100, 1500, 100):
        terms.append(follows.term(START + end * MS))
        if not follows.is_followed:
            break
    before, first, stays = terms[-3:]
    sigmas = [np.sqrt(np.linalg.eigvalsh(each.covariance)[-1]) for each in (before, first)]
    assert sigmas[0] < LIMITS.position_sigma < sigmas[1]
    np.testing.assert_array_equal(stays.T_target_source, first.T_target_source)
    np.testing.assert_allclose(stays.covariance - first.covariance,
                               (0.1 * LIMITS.speed_sigma) ** 2 * np.eye(3), atol=1e-12)


def test_where_it_was_followed_to_can_be_asked_for_again():
    follows = Displacement(last_measured(), next(some_forces(START + 300 * MS)), Exact(), LIMITS)
    assert follows.reached == START
    known = follows.term(START + 300 * MS)
    follows.term(START + 600 * MS)
    assert (follows.reached, follows.is_followed) == (START + 300 * MS, False)
    again = follows.term(START + 300 * MS)
    assert follows.is_followed
    np.testing.assert_array_equal(again.covariance, known.covariance)
