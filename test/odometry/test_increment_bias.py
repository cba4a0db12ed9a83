# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The bias of increments, learned from differences with known noise and known bias."""

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.increment_bias import IncrementBias
from aick_ros.registration.result import SensorBias

DEPTH = 2.0  # m
MOTION = se3.exp([0.02, -0.01, 0.02, 0.004, 0.01, -0.008])
SHIFT = np.hypot(0.03, DEPTH * np.sqrt(0.00018))  # m; of the scene, by that motion
TURN = np.sqrt(0.00018)
SIGMAS = np.array([3e-4, 3e-4, 6e-4, 1e-4, 2e-4, 1e-4])  # of one increment by one kind [m, rad]
NOISE = np.diag(SIGMAS ** 2)
HALF = 0.5 * np.eye(6)
OWN = PoseWithCovariance(MOTION, 1e-6 * np.eye(6))
SCATTER = 0.7  # variance of the joint pose by noise, by what the scatter of residuals shows


def biased(rng, degrees, noise=NOISE):
    """Return a bias of increments of a camera whose depth is registered wrong by an angle."""
    sigmas = np.radians(degrees) * np.repeat([SHIFT, TURN], 3)
    return rng.multivariate_normal(np.zeros(6), noise + np.diag(sigmas ** 2))


def learned(differences, covariance=NOISE, motion=OWN):
    model = IncrementBias()
    for difference in differences:
        model.add_to(motion, SensorBias(difference, covariance, HALF, covariance), DEPTH)
    return model


@pytest.mark.parametrize('degrees', [0.5, 2.0, 5.0])
def test_the_ratio_of_the_bias_to_the_motion_is_learned(degrees):
    rng = np.random.default_rng(3)
    found = []
    model = learned(biased(rng, degrees) for _ in range(30))
    for _ in range(200):
        model.add_to(OWN, SensorBias(biased(rng, degrees), NOISE, HALF, NOISE), DEPTH)
        found.append(model.ratio ** 2)
    assert np.sqrt(np.mean(found)) == pytest.approx(np.radians(degrees), rel=0.15)


def test_noise_alone_shows_next_to_no_bias():
    rng = np.random.default_rng(4)
    assert IncrementBias().ratio == pytest.approx(np.radians(2.0))
    ratios = [learned(biased(rng, 0.0) for _ in range(60)).ratio for _ in range(20)]
    # its standard deviation would be a tenth of the noise
    assert np.median(ratios) * SHIFT < 0.1 * SIGMAS[0]


def test_noise_along_a_direction_that_is_hardly_observed_is_no_bias():
    """As of depth along a wall: the mean square of the difference is a hundred times its own."""
    rng = np.random.default_rng(5)
    weak = NOISE + np.diag([0.0, 0.01 ** 2, 0, 0, 0, 0])
    model = learned((biased(rng, 0.5, weak) for _ in range(100)), weak)
    assert model.ratio == pytest.approx(np.radians(0.5), rel=0.4)


@pytest.mark.parametrize('degrees', [0.5, 3.0])
def test_a_motion_by_depth_alone_errs_by_the_share_of_the_bias_that_is_depths(degrees):
    """85 of 100, in every direction as learned of increments by both kinds: NEES."""
    rng = np.random.default_rng(8)
    model = learned(biased(rng, degrees) for _ in range(30))
    covariance = model.add_to_depth_alone(PoseWithCovariance(MOTION, 0.85 * NOISE),
                                          DEPTH).covariance
    errors = np.array([biased(rng, degrees) for _ in range(600)]) * np.sqrt(0.85)
    assert np.mean(np.einsum('ni,ij,nj->n', errors, np.linalg.inv(covariance), errors)
                   ) == pytest.approx(6.0, rel=0.2)


@pytest.mark.parametrize('degrees', [0.0, 0.5, 3.0])
def test_differences_are_as_their_covariance_says(degrees):
    """Where depth gives the pose, its error has the bias, of which 85 of 100 count: NEES."""
    rng = np.random.default_rng(6)
    model = learned(biased(rng, degrees) for _ in range(30))
    squares = []
    for _ in range(600):
        error = biased(rng, degrees)
        shown = SensorBias(biased(rng, degrees), NOISE, np.eye(6), NOISE)  # another draw
        covariance = model.add_to(PoseWithCovariance(MOTION, NOISE), shown, DEPTH).covariance
        squares.append(error @ np.linalg.solve(covariance, error))
    assert 5.0 < np.mean(squares) < 6 / SCATTER + 0.5  # of six degrees of freedom
    assert 0.8 < np.mean(np.array(squares) < chi2.ppf(0.95, 6)) < 0.98


def test_a_bias_acts_as_far_as_the_pose_follows_the_kind_that_has_it():
    """Of depth are 85 of 100, of keypoints the others."""
    ratio, squares = np.radians(2.0) ** 2, np.diag(np.repeat([SHIFT ** 2, TURN ** 2], 3))
    root = np.random.default_rng(7).normal(0, 0.4, (6, 6))
    for gain in (np.zeros((6, 6)), np.eye(6), root):
        found = IncrementBias().add_to(
            OWN, SensorBias(np.zeros(6), NOISE, gain, NOISE), DEPTH).covariance
        rest = np.eye(6) - gain
        np.testing.assert_allclose(found, SCATTER * OWN.covariance + ratio * (
            0.85 * gain @ squares @ gain.T + 0.15 * rest @ squares @ rest.T),
            rtol=1e-5, atol=1e-11)


def test_a_difference_that_is_not_usual_enlarges_the_covariance_at_once_and_is_forgotten():
    """Something moves in front of the camera."""
    rng = np.random.default_rng(8)
    model = learned(biased(rng, 0.5) for _ in range(60))
    ratio = model.ratio
    size = np.sqrt(np.diag(NOISE) + ratio ** 2 * np.repeat([SHIFT, TURN], 3) ** 2)

    def added(times):
        return model.add_to(OWN, SensorBias(times * size, NOISE, HALF, NOISE), DEPTH).covariance

    usual = added(0.0)
    assert added(1.0) == pytest.approx(usual, rel=0.2)
    unusual = added(30.0)
    np.testing.assert_allclose(unusual, 30 ** 2 * 6 / chi2.ppf(0.9, 6) * usual, rtol=0.3)
    np.testing.assert_allclose(added(0.0), usual, rtol=0.3)
    assert model.ratio == pytest.approx(ratio, rel=0.3)


def test_a_difference_on_the_quantile_is_usual():
    for factor, times in ((0.999, 1.0), (1.0, 1.0), (4.0, 4.0)):
        shown = SensorBias(np.zeros(6), NOISE, HALF, NOISE)
        usual = IncrementBias().add_to(OWN, shown, DEPTH).covariance
        sigma = np.sqrt(NOISE[0, 0] + (np.radians(2.0) * SHIFT) ** 2)
        shown = SensorBias(np.sqrt(factor * chi2.ppf(0.9, 6)) * sigma * np.eye(6)[0], NOISE,
                           HALF, NOISE)
        found = IncrementBias().add_to(OWN, shown, DEPTH).covariance
        np.testing.assert_allclose(found, times * usual, rtol=1e-3)


def test_a_camera_at_rest_has_no_bias_and_teaches_nothing():
    rng = np.random.default_rng(9)
    model = learned(biased(rng, 3.0) for _ in range(40))
    ratio, still = model.ratio, PoseWithCovariance(se3.exp(1e-5 * np.ones(6)), NOISE)
    for _ in range(300):
        found = model.add_to(still, SensorBias(biased(rng, 0.0), NOISE, np.eye(6), NOISE), DEPTH)
    assert model.ratio == ratio
    usual = model.add_to(still, SensorBias(np.zeros(6), NOISE, np.eye(6), NOISE), DEPTH)
    np.testing.assert_allclose(usual.covariance, SCATTER * NOISE, rtol=0.01, atol=1e-12)
    assert np.isfinite(found.covariance).all()


def test_a_bias_that_begins_is_covered_at_once_and_found_in_time():
    """As after a blow: the estimate was all but zero for long."""
    rng = np.random.default_rng(10)
    model = learned(np.zeros((500, 6)))
    assert model.ratio < np.radians(0.01)
    squares = []
    for _ in range(100):
        shown = SensorBias(biased(rng, 3.0), NOISE, np.eye(6), NOISE)
        covariance = model.add_to(PoseWithCovariance(MOTION, NOISE), shown, DEPTH).covariance
        squares.append(shown.difference @ np.linalg.solve(covariance, shown.difference))
    assert np.max(squares) < chi2.ppf(0.9, 6) / SCATTER + 0.1
    assert np.radians(1.0) < model.ratio < np.radians(6.0)


def test_without_a_difference_the_motion_stays_as_it_is():
    model = IncrementBias()
    assert model.add_to(OWN, None, DEPTH) is OWN
    assert model.ratio == IncrementBias().ratio


@pytest.mark.parametrize('difference, depth', [(1.0, DEPTH), (40.0, DEPTH), (1.0, 1e-9)])
def test_the_bias_of_an_increment_follows_depth_and_keypoints_by_the_gain(difference, depth):
    """By what it is written to be; an unusual difference lets all of the covariance grow."""
    rng = np.random.default_rng(8)
    gain, root = rng.uniform(-1, 1, (2, 6, 6))
    noise = 1e-7 * (root @ root.T + np.eye(6))
    shown = SensorBias(difference * rng.multivariate_normal(np.zeros(6), noise), noise, gain,
                       noise)
    model = IncrementBias()
    ratio, motion = model.ratio ** 2, PoseWithCovariance(MOTION, 1e-6 * noise)
    turn = np.sum(np.square(se3.log_rotation(MOTION[:3, :3])))
    shift = np.sum(np.square(MOTION[:3, 3])) + depth ** 2 * turn
    squares = np.repeat([shift, turn], 3)
    expected = noise + np.diag(ratio * squares)
    square = shown.difference @ np.linalg.solve(expected, shown.difference)
    rest = np.eye(6) - gain
    bias = ratio * (0.85 * gain @ np.diag(squares) @ gain.T
                    + 0.15 * rest @ np.diag(squares) @ rest.T)
    found = model.add_to(motion, shown, depth)
    np.testing.assert_allclose(
        found.covariance, (SCATTER * motion.covariance + bias) * max(square / 10.645, 1.0),
        rtol=1e-9, atol=1e-20)
    information = np.linalg.inv(expected)
    normalised = information @ shown.difference
    score = 0.5 * squares @ (min(19.805 / square, 1.0) * normalised ** 2 - np.diag(information))
    total = 0.5 * squares @ information ** 2 @ squares
    learned_ratio = np.clip(ratio + score / 2 / total, ratio / 4, 4 * ratio)
    assert model.ratio ** 2 == pytest.approx(max(learned_ratio, np.radians(0.001) ** 2))


def test_a_difference_without_a_covariance_adds_nothing():
    motion = PoseWithCovariance(np.eye(4), 1e-6 * np.eye(6))
    unknown = SensorBias(np.ones(6), np.zeros((6, 6)), HALF, np.zeros((6, 6)))
    assert IncrementBias().add_to(motion, unknown, DEPTH) is motion
