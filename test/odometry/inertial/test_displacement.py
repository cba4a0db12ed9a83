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
from aick_ros.odometry.inertial.displacement import Displacement, LastMeasured
from aick_ros.odometry.inertial.force_integral import ForceIntegral
from aick_ros.odometry.inertial.gravity_filter import GRAVITY, GravityFilter
from aick_ros.odometry.motion_term import ROTATION, MotionTerm
from aick_ros.settings import ImuSettings
from aick_ros.sources.synthetic.imu import ImuModel, SensorNoise, imu_samples

START, MS = 5 * NANOSECONDS, NANOSECONDS // 1000
SETTINGS = ImuSettings(accelerometer_bias_walk=0.0)
SIGMAS = np.repeat([0.01, 0.03, 0.02], 3)  # of velocity, gravity and bias [m/s, m/s^2]
TILT = 0.002  # rad; standard deviation of the orientation about each axis
PLACE = np.array([0.04, -0.02, 0.03])  # of the accelerometer in the camera [m]
EXACT = SensorNoise(0.0, 0.0, np.inf, 0.0)
SPEED = 0.7  # m/s
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

    def rotation(self, start, end):
        return pose(start)[:3, :3].T @ pose(end)[:3, :3]

    def term(self, start, end):
        return MotionTerm(se3.inverse(pose(start)) @ pose(end), ROTATION, 1e-16 * np.eye(3))


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
    term = Displacement(last_measured(), forces(), Exact(), SPEED).term(START + end * MS)
    np.testing.assert_allclose(term.T_target_source[:3, 3], truth(START + end * MS), atol=5e-4)
    np.testing.assert_allclose(term.rows, np.eye(3, 6))


def test_its_covariance_is_that_of_the_filter_by_a_factor():
    once, thrice = (Displacement(last_measured(), forces(), Exact(), SPEED, *factor).term(
        START + 400 * MS) for factor in ((), (9.0,)))
    np.testing.assert_allclose(thrice.covariance, 9.0 * once.covariance)
    np.testing.assert_array_equal(thrice.T_target_source, once.T_target_source)


def test_frames_on_the_way_change_nothing():
    """Each interval is followed once."""
    follows = Displacement(last_measured(), forces(), Exact(), SPEED)
    for end in (33, 67, 100, 100, 400):
        by_frames = follows.term(START + end * MS)
    at_once = Displacement(last_measured(), forces(), Exact(), SPEED).term(START + 400 * MS)
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
        true, estimate=estimate, pose=tilted), forces(noise, seed), Exact(), SPEED)


@pytest.mark.parametrize('end', [33, 300, 1000])
def test_it_errs_as_its_covariance_says(end):
    nees = []
    for seed in range(60):
        term = with_errors(seed).term(START + end * MS)
        error = term.T_target_source[:3, 3] - truth(START + end * MS)
        nees.append(error @ np.linalg.solve(term.covariance, error))
    low, high = stats.chi2.ppf([0.001, 0.999], 3 * len(nees)) / len(nees)
    assert low < np.mean(nees) < high


def test_an_uncertain_place_of_the_accelerometer_counts_as_the_camera_turns():
    estimate = last_measured().estimate
    estimate.values[12:15] = PLACE
    estimate.covariance[range(12, 15), range(12, 15)] = 0.05 ** 2
    end = START + 500 * MS
    known = Displacement(last_measured(), forces(), Exact(), SPEED).term(end)
    found = Displacement(last_measured(estimate=estimate, position=np.zeros(3)), forces(),
                         Exact(), SPEED).term(end)
    np.testing.assert_allclose(found.T_target_source[:3, 3], known.T_target_source[:3, 3],
                               atol=1e-12)
    turned = Exact().rotation(START, end) - np.eye(3)
    np.testing.assert_allclose(found.covariance - known.covariance,
                               0.05 ** 2 * turned @ turned.T, atol=1e-12)


def test_forces_are_those_of_their_own_clock():
    late = Displacement(last_measured(offset=7 * MS), forces(offset=7 * MS), Exact(), SPEED)
    end = START + 300 * MS
    np.testing.assert_allclose(late.term(end).T_target_source[:3, 3], truth(end), atol=3e-4)


@pytest.mark.parametrize('arrived, known', [(START + 260 * MS, True), (START + 200 * MS, False)])
def test_it_waits_for_samples(arrived, known):
    """A term is not known without them, and is as before once they have arrived."""
    every, some, end = forces(), ForceIntegral(), START + 300 * MS
    count = every._stamps.searchsorted(arrived)
    some.add(every._stamps[:count], every._forces[:count])
    follows = Displacement(last_measured(), some, Exact(), SPEED)
    assert (follows.term(end) is not None) is known
    some.add(every._stamps[count:], every._forces[count:])
    np.testing.assert_allclose(follows.term(end).T_target_source[:3, 3], truth(end), atol=1e-3)


@pytest.mark.parametrize('unknown', ['term', 'rotation'])
def test_without_a_gyroscope_it_is_not_known(unknown):
    gyroscope = Exact()
    setattr(gyroscope, unknown, lambda start, end: None)
    assert Displacement(last_measured(), forces(), gyroscope, SPEED).term(START + 33 * MS) is None


def test_nothing_is_known_of_what_is_before():
    follows = Displacement(last_measured(), forces(), Exact(), SPEED)
    assert follows.term(START + 100 * MS) is not None
    assert follows.term(START + 33 * MS) is None


def test_it_is_followed_until_it_is_not_known_any_more():
    """Then it stays, and a camera that moves as it may is somewhere beside."""
    last = last_measured()
    last.estimate.covariance *= 100
    follows, before = Displacement(last, forces(), Exact(), SPEED), None
    for end in range(100, 1500, 100):
        term = follows.term(START + end * MS)
        if not follows.is_followed:
            break
        before = term
    sigmas = [np.sqrt(np.linalg.eigvalsh(each.covariance)[-1]) for each in (before, term)]
    assert sigmas[0] < 0.3 < sigmas[1]
    later = follows.term(START + end * MS + NANOSECONDS)
    np.testing.assert_array_equal(later.T_target_source, term.T_target_source)
    np.testing.assert_allclose(later.covariance - term.covariance, SPEED ** 2 * np.eye(3),
                               atol=1e-12)
