# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Noise learned from registrations: closed forms, random noise and wrong settings."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.measured_noise import MeasuredNoise, Noise
from aick_ros.registration.refinement.point_choice import PointChoice
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.refinement.residuals import (
    SURFACE_NOISE, NormalEquations, point_to_plane, reprojection)
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.registration.samples import NoiseSample, PosesByKind
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

SLOW, FAST = 10.0, 100.0  # px
SQUARES = np.array([4e-6, 1e-6])

# no residual is an outlier: all weights are 1, and the problem is a linear one
SETTINGS = with_values(Settings(), {'refinement.robust_width': 100.0})
CAMERA = Camera(640, 480, 200.0, 200.0, 319.5, 239.5)  # wide: many parts with errors of their own
RAY_SIGMA = SETTINGS.refinement.track_sigma / CAMERA.fx
CORNER = np.array([(0.8, 0, 0.6), (-0.6, 0, 0.8), (0, 0.8, 0.6)])  # normals of three walls
TRUTH = se3.exp([0.002, -0.003, 0.001, 0.001, -0.002, 0.001])


def seen(pose):
    """Return a view of the corner of three walls, without an error."""
    v, u = np.indices((CAMERA.height, CAMERA.width))
    rays = CAMERA.normalize(np.column_stack([u.ravel(), v.ravel()]).astype(float))
    rays = np.column_stack([rays, np.ones(len(rays))]) @ pose[:3, :3].T
    with np.errstate(divide='ignore'):
        depths = (CORNER @ (0, 0, 2.0) - CORNER @ pose[:3, 3]) / (rays @ CORNER.T)
    depth = np.where(depths > 0, depths, np.inf).min(axis=1).reshape(u.shape).astype(np.float32)
    grey = np.zeros(u.shape, np.uint8)
    frame = RgbdFrame(int(1e8 * np.any(pose != np.eye(4))), grey, depth, CAMERA)
    surface = Surface.of(depth, CAMERA, SETTINGS.sensor, 2000)
    return PreparedFrame(frame, KeypointFrame.none(frame.stamp), grey, dataclasses.replace(
        surface, roughness=np.zeros_like(surface.roughness)))


@pytest.fixture(scope='module')
def views():
    """Return the view of a source and that of its target."""
    return seen(TRUTH), seen(np.eye(4))


def tracks(rng, factor=1.0):
    """Return 400 tracks with that many of their sigmas as noise, of points without depth noise."""
    points = rng.uniform((-1.6, -1.2, 1.0), (1.6, 1.2, 1.0), (400, 3))
    points *= rng.uniform(1.0, 4.0, (400, 1))
    moved = se3.transform(TRUTH, points)
    rays = moved[:, :2] / moved[:, 2:] + factor * RAY_SIGMA * rng.normal(size=(400, 2))
    return Tracks(np.arange(400), points, rays, np.full(400, np.nan), np.full(400, 1e-9))


@pytest.fixture
def measured(views, monkeypatch):
    """
    Return a function that refines the true pose by measurements with known errors.

    Tracks have white noise of their sigma times a factor, depths that of the sensor model.
    """
    def refined(seed, noise, factor=1.0, has_depth=True, settings=SETTINGS, shift=np.zeros(3)):
        source, target = views
        rng = np.random.default_rng(seed)
        shown, surface = tracks(rng, factor), source.surface
        e = SURFACE_NOISE * SETTINGS.sensor.depth_sigma * rng.normal(size=(len(surface.points), 1))
        surface = dataclasses.replace(
            surface, points=np.float32(surface.points / (1 + e * surface.points[:, 2:]) + shift),
            chosen=surface.chosen[:None if has_depth else 0])
        monkeypatch.setattr(Tracker, 'track', lambda *_: shown)
        return Refinement(settings.refinement, settings.sensor, noise).refine(
            dataclasses.replace(source, surface=surface), target, TRUTH)
    return refined


def nees(refined):
    """Return the squared error of a refined pose by the covariance of its noise."""
    error = se3.difference(TRUTH, refined.T_target_source)
    return error @ np.linalg.solve(refined.covariance - refined.systematic, error)


def sample(ratio=1.0, normalised=1.0, squares=SQUARES, motion=SLOW):
    return NoiseSample(motion, ratio, normalised, squares)


def learned(*samples):
    noise = MeasuredNoise()
    for one in samples:
        noise.learn(one)
    return noise


def test_noise_is_seen_once_the_residuals_of_depth_show_it():
    noise, none = MeasuredNoise(), MeasuredNoise()
    for count in range(1, 41):
        assert noise.is_seen == (count > 10)
        noise.learn(dataclasses.replace(sample(), depth_residual=0.03))
        none.learn(dataclasses.replace(sample(), depth_residual=0.015))
        noise.learn(sample())  # by keypoints alone: it shows none
    assert not none.is_seen
    for _ in range(200):  # the camera of a simulation gets noise
        none.learn(dataclasses.replace(sample(), depth_residual=0.03))
    assert none.is_seen


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


@pytest.mark.parametrize('normalised, share', [
    (1.0, 0.0), (1.6, 0.0), (np.sqrt(1.7 * 4.0), 0.5), (4.2, 1.0), (30.0, 1.0)])
def test_differences_that_scatter_alone_may_leave_are_no_bias(normalised, share):
    """Scatter does not show all of the noise: cameras without a bias differ by twice of it."""
    usual = normalised / np.exp(0.176)  # the mean logarithm of normal errors is 0.176 lower
    noise = learned(*[sample(normalised=usual)] * 300).expected(SLOW)
    excess = share * (1.0 - 1.0 / normalised)
    np.testing.assert_allclose(np.diag(noise.bias), excess * np.repeat(SQUARES, 3)
                               * np.exp(0.369), rtol=0.02, atol=1e-12)


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


def of_all_motions(ratio):
    return learned(*[sample(ratio, motion=motion) for motion in (1.0, 4.0, SLOW, 30.0, FAST)
                     for _ in range(300)])


@pytest.mark.parametrize('factor', [0.5, 1.0, 2.0])
def test_the_ratio_is_that_of_the_variances(measured, factor):
    """Of tracks with that many of their sigmas, by that of depths with one of theirs."""
    ratios = [measured(seed, MeasuredNoise(), factor).measure.noise().ratio for seed in range(12)]
    assert np.exp(np.mean(np.log(ratios))) == pytest.approx(factor ** 2, rel=0.15)


@pytest.mark.parametrize('ratio', [0.25, 4.0])
def test_the_weight_of_keypoints_does_not_change_their_covariance(measured, ratio):
    """Without depth: the scatter of weighted residuals grows with the square of the weight."""
    plain, weighted = (measured(1, of_all_motions(one), has_depth=False) for one in (1.0, ratio))
    np.testing.assert_allclose(weighted.T_target_source, plain.T_target_source, atol=1e-7)
    # beside the scatter there is 0.01 of the variance that the weight says
    shares = np.linalg.eigvals(np.linalg.solve(plain.covariance - plain.systematic,
                                               weighted.covariance - weighted.systematic))
    np.testing.assert_allclose(shares, (1 + 0.01 * ratio) / 1.01, rtol=0.03)


@pytest.mark.parametrize('ratio', [1.0, 9.0])
@pytest.mark.parametrize('has_depth', [False, True])
def test_whatever_the_weight_the_covariance_is_that_of_the_error(measured, ratio, has_depth):
    """Tracks with three times their noise, which is learned or not: the NEES is 6 on average."""
    noise = of_all_motions(ratio)
    squares = [nees(measured(seed, noise, 3.0, has_depth)) for seed in range(60)]
    # chi-square with 6 degrees of freedom, beyond it once in 1000; the scatter is an estimate
    assert stats.chi2.ppf(0.001, 360) / 60 < np.mean(squares) < 1.25 * stats.chi2.ppf(
        0.999, 360) / 60


@pytest.fixture
def displaced(measured, views, monkeypatch):
    """
    Return a function that refines twice: all points of the source are displaced the second time.

    With them, the information of keypoints and of depth, and what depth alone has displaced.
    """
    shift = np.array([0.0, 0.0, 0.001])
    by_depth = point_to_plane(*(view.surface for view in views), TRUTH, SETTINGS.sensor, 100.0,
                              0.1)
    by_keypoints = reprojection(tracks(np.random.default_rng(1)), TRUTH, RAY_SIGMA, 100.0)

    def refined(noise):
        monkeypatch.setattr(MeasuredNoise, 'expected', lambda *_: noise)
        plain, moved = (measured(1, MeasuredNoise(), shift=one) for one in (np.zeros(3), shift))
        return (moved, se3.difference(moved.T_target_source, plain.T_target_source),
                NormalEquations.of([by_keypoints]).information,
                NormalEquations.of([by_depth]).information,
                np.array([*(-TRUTH[:3, :3] @ shift), 0.0, 0.0, 0.0]))
    return refined


@pytest.mark.parametrize('sigma', [1e-6, 1e-3, 1e-2])
def test_a_bias_of_depth_leaves_the_pose_to_the_keypoints(displaced, sigma):
    """
    The points of the source are displaced by one millimetre, its keypoints are not.

    Depth alone has the pose displaced by as much, d, with information J_d. Where it may have a
    bias of covariance B, its information is M = (J_d^-1 + B)^-1, and with keypoints of
    information J the pose is displaced by (J + M)^-1 M d.
    """
    bias = sigma ** 2 * np.eye(6)
    moved, found, by_keypoints, by_depth, alone = displaced(Noise(1.0, bias, bias))
    biased = np.linalg.inv(np.linalg.inv(by_depth) + bias)
    joint = np.linalg.inv(by_keypoints + biased)
    expected = joint @ biased @ alone
    np.testing.assert_allclose(found, expected, atol=0.03 * np.abs(expected).max() + 1e-6)
    # what the bias adds is the same for all points, and not in their scatter
    noise = by_keypoints + biased @ np.linalg.solve(by_depth, biased)
    np.testing.assert_allclose(np.diag(moved.covariance - bias), np.diag(joint @ noise @ joint),
                               rtol=0.5)


@pytest.mark.parametrize('sigma', [0.0, 1e-4, 1e-3, 1e-2])
def test_jitter_of_keypoints_leaves_the_position_to_depth(displaced, sigma):
    """Depth has the pose displaced, as above: it is the more so, the more keypoints jitter."""
    jitter = np.diag([sigma ** 2] * 3 + [0.0] * 3)
    _, found, by_keypoints, by_depth, alone = displaced(Noise(keypoint_jitter=jitter))
    jittering = np.linalg.inv(np.linalg.inv(by_keypoints) + jitter)
    expected = np.linalg.inv(jittering + by_depth) @ by_depth @ alone
    np.testing.assert_allclose(found, expected, atol=0.03 * np.abs(expected).max() + 1e-6)


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


def test_jitter_is_that_of_three_registrations_in_a_row():
    """After every two, one shows no poses: those on either side are not compared, when ever."""
    rng, noise = np.random.default_rng(4), MeasuredNoise()
    for i in range(60):
        poses = PosesByKind((10 ** 9 + (i - i // 3) * 10 ** 7, 0), se3.exp(
            (*rng.normal(0.0, 0.003, 3), 0.0, 0.0, 0.0)), np.eye(4), 1e-6)
        noise.learn(dataclasses.replace(sample(), poses=None if i % 3 == 2 else poses))
    assert not noise.expected(SLOW).keypoint_jitter.any()


@pytest.mark.parametrize('factor', [1 / 3, 3.0])
def test_wrong_settings_are_corrected(measured, factor):
    """A track sigma that is wrong by a factor: once learned, the pose is that of the right one."""
    wrong = with_values(SETTINGS, {
        'refinement.track_sigma': factor * SETTINGS.refinement.track_sigma})

    def refined(settings):
        """Return the samples of some registrations, and one by what was learned of them."""
        samples = [measured(seed, MeasuredNoise(), settings=settings).measure.noise()
                   for seed in range(20)]
        noise = learned(*10 * samples)
        noise.points = PointChoice()  # both of the same points
        return samples, [measured(50, one, settings=settings) for one in (MeasuredNoise(), noise)]

    (samples, (_, by_right)), (scaled, by_wrong) = refined(SETTINGS), refined(wrong)
    off = np.array([abs(factor ** 2 * one.ratio / right.ratio - 1.0)
                    for one, right in zip(scaled, samples)])
    assert np.quantile(off, 0.9) < 0.01 and off.max() < 0.05
    sigmas = np.sqrt(np.diag(by_right.covariance - by_right.systematic))
    before, after = (np.abs(se3.difference(one.T_target_source, by_right.T_target_source)
                            / sigmas).max() for one in by_wrong)
    assert before > 0.2
    assert after < 0.02
    np.testing.assert_allclose(by_wrong[1].covariance, by_right.covariance, rtol=0.02, atol=1e-9)


def test_it_learns_which_points_to_take():
    noise, shown = MeasuredNoise(), []
    noise.points.learn = shown.append
    for rare in (0.7, None, -0.2):
        noise.learn(NoiseSample(SLOW, 1.0, 0.1, SQUARES, rare=rare))
    assert shown == [0.7, -0.2]


def test_where_keypoints_and_depth_differ_small_surfaces_err_no_more_than_large_ones():
    """The bias of the camera is not in the scatter; that of other motions does not count."""
    noise, shown = MeasuredNoise(), []
    noise.points.learn = shown.append
    for _ in range(30):
        noise.learn(NoiseSample(SLOW, 1.0, 9.0, SQUARES))
        noise.learn(NoiseSample(FAST, 1.0, 1.0, SQUARES))
    for motion in (SLOW, FAST):
        for rare in (0.7, -0.2):
            noise.learn(NoiseSample(motion, 1.0, 1.0, SQUARES, rare=rare))
    assert shown == [0.0, -0.2, 0.7, -0.2]


def test_what_another_range_lends_counts_as_the_prior_does():
    """As three registrations: a first one of its own is a quarter of the mean of logarithms."""
    noise = MeasuredNoise()
    for _ in range(100):
        noise.learn(NoiseSample(SLOW, 4.0, 1.0, SQUARES))
    lent = noise.expected(SLOW).keypoints
    assert noise.expected(FAST).keypoints == lent
    noise.learn(NoiseSample(FAST, 64.0, 1.0, SQUARES))
    assert noise.expected(FAST).keypoints == pytest.approx(lent ** 0.75 * 64.0 ** 0.25)
    assert noise.expected(SLOW).keypoints == lent


def test_the_shape_of_the_scatter_is_the_mean_of_either_kind():
    noise = MeasuredNoise()
    shapes = np.diag([6.0, 0, 0, 0, 0, 0]), np.diag([0, 0, 0, 0, 0, 6.0])
    for _ in range(200):
        noise.learn(NoiseSample(SLOW, 1.0, 1.0, SQUARES, scatters=shapes))
    noise.learn(NoiseSample(SLOW, 1.0, 1.0, SQUARES))  # shows none
    for motion in (SLOW, FAST):
        expected = noise.expected(motion)
        for found, shape in zip((expected.keypoint_scatter, expected.depth_scatter), shapes):
            np.testing.assert_allclose(found.shape, shape, atol=0.2)
