# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Noise learned from registrations: closed forms, random noise and wrong settings."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.refinement.measured_noise import MeasuredNoise, Noise, NoiseSample
from aick_ros.registration.refinement.position_jitter import PosesByKind
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

SLOW, FAST = 10.0, 100.0  # px
SQUARES = np.array([4e-6, 1e-6])


@pytest.fixture(scope='module')
def views():
    """Return two views of a room, the second first, and its true pose in the first."""
    source = SyntheticSource(SyntheticOptions(seed=3))
    poses, registrar = source.ground_truth.poses, Registrar()
    return (*(registrar.prepare(source.frame(i)) for i in (3, 0)),
            se3.inverse(poses[0]) @ poses[3])


def sample(ratio=1.0, normalised=1.0, squares=SQUARES, motion=SLOW):
    return NoiseSample(motion, ratio, normalised, squares)


def learned(*samples):
    noise = MeasuredNoise()
    for one in samples:
        noise.learn(one)
    return noise


def test_a_new_camera_has_the_settings_and_the_bias_of_a_kinect():
    for motion in (0.0, SLOW, FAST):
        noise = MeasuredNoise().expected(motion)
        assert noise.keypoints == 1.0
        sigmas = np.sqrt(np.diag(noise.bias))
        assert (sigmas[:3] > 0.001).all() and (sigmas[:3] < 0.01).all()
        assert (np.degrees(sigmas[3:]) > 0.05).all() and (np.degrees(sigmas[3:]) < 0.3).all()


@pytest.mark.parametrize('ratio', [0.2, 1.0, 7.0])
def test_the_weight_of_keypoints_is_by_their_scatter(ratio):
    noise = learned(*[sample(ratio)] * 200).expected(SLOW)
    assert noise.keypoints == pytest.approx(ratio, rel=0.01)


def test_few_registrations_count_little():
    assert learned(sample(100.0)).expected(SLOW).keypoints < 5


def test_one_bad_registration_changes_little():
    noise = learned(*[sample()] * 50, sample(1e9, 1e9, np.ones(2)), *[sample()] * 3)
    assert noise.expected(SLOW).keypoints < 1.5
    assert np.sqrt(noise.expected(SLOW).bias[0, 0]) < 2 * np.sqrt(SQUARES[0])


def test_keypoints_with_a_significant_bias_gain_no_weight_but_may_lose_it():
    """A bias does not show in the scatter."""
    assert learned(*[sample(0.2, 30.0)] * 100).expected(SLOW).keypoints == 1.0
    assert learned(*[sample(7.0, 30.0)] * 100).expected(SLOW).keypoints == pytest.approx(
        7, rel=0.05)


def test_a_systematic_bias_has_its_size():
    squares = np.repeat(SQUARES, 3)
    noise = learned(*[sample(normalised=100.0, squares=SQUARES)] * 300)
    variances = np.diag(noise.expected(SLOW).bias)
    # of constant squares; of those of normal errors the mean logarithm is 0.369 lower
    np.testing.assert_allclose(variances, squares * np.exp(0.369), rtol=0.02)


def test_the_share_of_the_bias_that_is_of_depth_grows_with_the_motion():
    noise = learned(*[sample(normalised=100.0, motion=motion) for motion in (SLOW, FAST)
                      for _ in range(100)])
    deviations = []
    for motion in (0.0, 60.0, 120.0, 600.0, 1e4):
        expected = noise.expected(motion)
        share = np.trace(expected.depth_bias) / np.trace(expected.bias)
        np.testing.assert_allclose(expected.depth_bias, share * expected.bias)
        deviations.append(np.sqrt(share))
    np.testing.assert_allclose(deviations, [0.0, 0.1, 0.2, 1.0, 1.0], atol=1e-9)


@pytest.mark.parametrize('size', [0.0, 5.0])
def test_the_bias_is_what_noise_does_not_explain(size):
    """The difference has the variance of its noise, 1, and that of a bias in random directions."""
    rng = np.random.default_rng(2)
    noise, found = MeasuredNoise(), []
    for difference in np.sqrt(1 + size ** 2) * rng.normal(size=(600, 6)):
        noise.learn(sample(normalised=np.mean(difference ** 2),
                           squares=1e-6 * np.mean(difference.reshape(2, 3) ** 2, axis=1)))
        found.append(np.trace(noise.expected(SLOW).bias) / 6e-6)
    assert np.mean(found[60:]) == pytest.approx(size ** 2, rel=0.15, abs=0.15)


def test_each_range_of_motion_has_its_own_noise():
    noise = learned(*[sample(5.0)] * 100, *[sample(2.0, motion=FAST)] * 100)
    assert noise.expected(SLOW).keypoints == pytest.approx(5, rel=0.05)
    assert noise.expected(FAST).keypoints == pytest.approx(2, rel=0.05)


def test_motions_never_seen_have_the_noise_of_the_nearest():
    noise = learned(*[sample(5.0)] * 100)
    assert noise.expected(FAST).keypoints == noise.expected(SLOW).keypoints


def test_motions_between_two_that_were_seen_have_the_noise_of_the_nearer():
    for order in (1, -1):
        noise = learned(*[*[sample(5.0)] * 100, *[sample(2.0, motion=FAST)] * 100][::order])
        assert noise.expected(0.0).keypoints == pytest.approx(5, rel=0.05)


def test_the_gain_of_weight_ends_where_the_squared_bias_is_three_to_five_times_its_noise():
    """At their geometric mean keypoints gain half of what the scatter shows."""
    rng = np.random.default_rng(4)
    noise, gained = MeasuredNoise(), []
    for difference in 15 ** 0.25 * rng.normal(size=(500, 6)):
        noise.learn(sample(0.2, np.mean(difference ** 2)))
        gained.append(np.log(noise.expected(SLOW).keypoints) / np.log(0.2))
    assert np.mean(gained[100:]) == pytest.approx(0.5, abs=0.1)


def test_the_weight_of_keypoints_does_not_change_their_covariance(views):
    """Without a usable depth image: the scatter of weighted residuals grows with its square."""
    source, target = views[:2]
    source = dataclasses.replace(source, surface=dataclasses.replace(
        source.surface, chosen=source.surface.chosen[:0]))
    covariances = []
    for ratio in (1.0, 0.25):
        noise = learned(*[sample(ratio, motion=motion) for motion in (1.0, 4.0, SLOW, 30.0, FAST)
                          for _ in range(100)])
        found = Refinement(Settings().refinement, Settings().sensor, noise).refine(
            source, target, views[2])
        covariances.append(np.diag(found.covariance - found.systematic))
    # with the weight in it, it would be a quarter
    np.testing.assert_allclose(covariances[1] / covariances[0], 1.0, atol=0.45)


def test_a_bias_of_depth_leaves_the_pose_to_the_keypoints(views, monkeypatch):
    """The surface of the source is displaced by one centimetre, its keypoints are not."""
    source, target, truth = views
    shift = np.array([0.0, 0.0, 0.01])
    source = dataclasses.replace(source, surface=dataclasses.replace(
        source.surface, points=np.float32(source.surface.points + shift)))
    bias = 1e-4 * np.eye(6)  # 1 cm, 0.6 deg
    errors, extents = [], []
    for depth_bias in (np.zeros((6, 6)), bias):
        monkeypatch.setattr(MeasuredNoise, 'expected',
                            lambda noise, motion, of_depth=depth_bias: Noise(1.0, bias, of_depth))
        found = Refinement(Settings().refinement, Settings().sensor).refine(
            source, target, truth)
        errors.append(np.linalg.norm(se3.difference(found.T_target_source, truth)[:3]))
        extents.append(np.trace((found.covariance - found.systematic)[:3, :3]))
    assert errors[0] > 0.003
    assert errors[1] < 0.3 * errors[0]
    assert extents[1] > extents[0]  # depth says less


def test_jitter_of_keypoints_leaves_the_position_to_depth(views, monkeypatch):
    """All keypoints of the source are displaced by one centimetre, its surface is not."""
    source, target, truth = views
    keypoints = dataclasses.replace(source.keypoints, positions=np.float32(
        source.keypoints.positions + (0.01, 0.0, 0.0)))
    source = dataclasses.replace(source, keypoints=keypoints)
    errors = []
    for variance in (0.0, 1e-4):
        noise = Noise(0.01, keypoint_jitter=np.diag([variance] * 3 + [0.0] * 3))
        monkeypatch.setattr(MeasuredNoise, 'expected', lambda *_, expected=noise: expected)
        found = Refinement(Settings().refinement, Settings().sensor).refine(
            source, target, truth)
        errors.append(np.linalg.norm(se3.difference(found.T_target_source, truth)[:3]))
    assert errors[0] > 0.003
    assert errors[1] < 0.5 * errors[0]


def test_keypoints_that_jitter_in_one_range_of_motion_do_so_there_alone():
    rng = np.random.default_rng(3)
    noise = learned(*[sample(motion=FAST)] * 20)
    for i in range(200):
        noise.learn(dataclasses.replace(sample(), poses=PosesByKind(
            (10 ** 9 + i * 10 ** 7, 0), se3.exp((*rng.normal(0.0, 0.003, 3), 0.0, 0.0, 0.0)),
            np.eye(4), 1e-6)))
    jitter = noise.expected(SLOW).keypoint_jitter
    np.testing.assert_array_equal(jitter, np.diag(np.diag(jitter)))
    np.testing.assert_array_equal(np.diag(jitter)[3:], 0.0)
    assert np.sqrt(np.diag(jitter)[:3]) == pytest.approx(np.sqrt(8e-6), rel=0.35)
    assert not noise.expected(FAST).keypoint_jitter.any()


def test_wrong_settings_are_corrected(views):
    """A track sigma six times too small: once learned, the weights are as with the right one."""
    right = Settings()
    wrong = with_values(right, {
        'refinement.track_sigma': right.refinement.track_sigma / 6})

    def refined(settings):
        """Return the refinement by the settings, and that after some registrations."""
        noise = MeasuredNoise()
        refinement = Refinement(settings.refinement, settings.sensor, noise)
        first = refinement.refine(*views)
        for _ in range(60):
            noise.learn(first.noise)
        return first, refinement.refine(*views)

    by_right, by_wrong = refined(right), refined(wrong)
    ratios = [pair[0].noise.ratio for pair in (by_right, by_wrong)]
    assert ratios[1] > 4 * ratios[0]
    before, after = (np.abs(se3.difference(by_wrong[i].T_target_source,
                                           by_right[1].T_target_source)).max() for i in (0, 1))
    assert after < 0.75 * before
