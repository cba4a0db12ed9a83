# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Covariance of unusual bias and of stamps, against closed forms and random noise."""

import dataclasses

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.result import Registration, SensorBias
from aick_ros.registration.status import Status
from aick_ros.registration.systematic_error import (
    SystematicError, errors_of_offset, errors_of_optics, errors_of_scale)

NOISE = np.diag([2e-6, 1e-6, 4e-6, 1e-6, 2e-6, 3e-6])  # of the bias
OWN = se3.skew([0.1, 0.2, 0.3]) @ se3.skew([0.1, 0.2, 0.3]).T
OWN = 1e-6 * np.block([[OWN + np.eye(3), 0.1 * OWN], [0.1 * OWN, np.eye(3)]])
PERIOD = 0.04


def view(seconds, jitter=0.0):
    stamp = round(seconds * NANOSECONDS)
    frame = RgbdFrame(stamp, np.zeros((3, 4), np.uint8), np.ones((3, 4), np.float32),
                      Camera(4, 3, 4.0, 4.0, 1.5, 1.0))
    keypoints = KeypointFrame(stamp, np.empty((0, 3)), np.empty((0, 32), np.uint8),
                              np.empty((0, 3, 3)), np.empty((0, 2)))
    return PreparedFrame(frame, keypoints, frame.grey, stamp_jitter=jitter)


def registration(motion=np.eye(4), difference=np.zeros(6), covariance=OWN):
    return Registration(Status.OK, '', motion, covariance, np.empty((0, 2), np.intp), 1,
                        bias=SensorBias(difference, NOISE, np.eye(6), NOISE))


def added(model, difference):
    """Return what steady stamps and a bias add, 6x6."""
    complete = model.add_to(registration(difference=difference), view(1 + PERIOD), view(1))
    return complete.covariance - OWN


def used():
    """Return the model of a camera that had no bias for a while."""
    model = SystematicError()
    for _ in range(60):
        added(model, np.sqrt(np.diag(NOISE)))
    return model


def test_a_bias_of_the_size_of_its_noise_adds_nothing():
    model = used()
    for _ in range(40):
        np.testing.assert_array_equal(added(model, np.sqrt(np.diag(NOISE))), 0.0)


def test_noise_adds_little():
    rng = np.random.default_rng(3)
    model = SystematicError()
    sums = [added(model, difference) for difference in rng.multivariate_normal(
        np.zeros(6), NOISE, 2000)]
    for part in (slice(0, 3), slice(3, 6)):
        share = np.diag(np.mean(sums[30:], axis=0))[part].sum() / np.diag(NOISE)[part].sum()
        assert share < 0.2


def test_after_many_small_biases_one_of_the_size_of_its_noise_is_not_unusual():
    model = SystematicError()
    for _ in range(200):
        added(model, np.zeros(6))
    np.testing.assert_array_equal(added(model, np.sqrt(np.diag(NOISE))), 0.0)


def test_an_unusual_bias_adds_its_size_at_once():
    model = used()
    sigmas = np.sqrt(np.diag(NOISE))
    for _ in range(30):
        np.testing.assert_array_equal(added(model, 0.6 * sigmas), 0.0)
    once = np.diag(added(model, 3 * sigmas))
    for part in (slice(0, 3), slice(3, 6)):
        np.testing.assert_allclose(once[part], np.mean(9 * np.diag(NOISE)[part]))
    np.testing.assert_array_equal(added(model, 0.6 * sigmas), 0.0)


def test_an_unusual_bias_and_an_uncertain_delay_are_told_apart():
    """From what is expected, from noise and from errors of stamps."""
    before, difference = np.diag(np.arange(1.0, 7.0)), 3 * np.sqrt(1.7 * np.diag(NOISE))
    moved = dataclasses.replace(
        registration(se3.exp([0.01, 0, 0, 0, 0, 0]), difference, OWN + before), systematic=before)
    complete = SystematicError().add_to(
        moved, view(1 + PERIOD, 0.002), view(1, 0.002), ExpectedPose(np.eye(4), PERIOD),
        delay_sigma=0.01)
    unusual = np.repeat(np.mean(difference.reshape(2, 3) ** 2, axis=1), 3)
    delay = np.diag([(0.01 * 0.01 / PERIOD) ** 2] + 5 * [0.0])
    np.testing.assert_allclose(complete.unusual, np.diag(unusual) + delay, rtol=1e-9, atol=1e-15)
    assert complete.systematic is before
    np.testing.assert_allclose(complete.unbiased_pose.covariance, OWN, atol=1e-12)
    assert complete.timing[0, 0] > 2 * (0.005 * 0.01) ** 2


@pytest.mark.parametrize('ratio, share', [(2.5, 0.0), (2.625, 0.25), (2.75, 0.5), (3.2, 1.0)])
def test_a_bias_is_compared_with_those_before_it(ratio, share):
    """The first one with the prior, 1.7: by as many times that, it is systematic by a share."""
    difference = np.sqrt(1.7 * ratio * np.diag(NOISE))
    squares = np.repeat(np.mean(difference.reshape(2, 3) ** 2, axis=1), 3)
    np.testing.assert_allclose(added(SystematicError(), difference),
                               share * np.diag(squares), atol=1e-9)


def test_a_constant_bias_is_not_unusual():
    """It is in the covariance already, as measured noise."""
    model, sigmas = SystematicError(), np.sqrt(np.diag(NOISE))
    for _ in range(400):
        usual = added(model, 3 * sigmas)
    np.testing.assert_array_equal(usual, 0.0)


def test_a_past_bias_is_forgotten():
    model, sigmas = used(), np.sqrt(np.diag(NOISE))
    for _ in range(50):
        added(model, 3 * sigmas)
    for _ in range(250):
        added(model, 0.6 * sigmas)
    assert added(model, 3 * sigmas)[0, 0] > 0.0


def test_jitter_adds_the_distance_travelled_in_it():
    """Both stamps have errors of 3.3 jitters, along the motion where no velocity is known."""
    velocity, jitter = np.array([0.3, -0.4, 1.2, 0.0, 0.0, 0.0]), 0.001
    turn_rate = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0])
    source, target = view(1 + PERIOD, jitter), view(1, jitter / 2)
    for rates in (velocity, turn_rate):
        motion = np.eye(4)
        motion[:3, 3] = rates[:3] * PERIOD
        motion[:3, :3] = Rotation.from_rotvec(rates[3:] * PERIOD).as_matrix()
        moved = used().add_to(registration(motion), source, target).covariance - OWN
        np.testing.assert_allclose(moved, 2 * (3.3 * jitter) ** 2 * np.outer(rates, rates),
                                   atol=1e-15)


def test_errors_of_stamps_act_along_the_velocity_that_each_image_is_taken_at():
    """As images that are taken a little later than their stamps say have it."""
    rng, sigma = np.random.default_rng(5), 0.003
    motion = se3.exp([0.1, 0.05, -0.2, 0.3, -0.1, 0.2])
    twists = rng.normal(0, [[0.5] * 3 + [1.0] * 3], (2, 6))
    views = [dataclasses.replace(view(stamp, sigma), twist=twist)
             for stamp, twist in zip((2, 1), twists)]
    complete = used().add_to(registration(motion), *views)
    late = [se3.difference(se3.inverse(se3.exp(twists[1] * target)) @ motion
                           @ se3.exp(twists[0] * source), motion)
            for source, target in rng.normal(0, 0.005, (20000, 2))]
    np.testing.assert_allclose(complete.timing, np.cov(np.transpose(late)), atol=8e-7)
    assert np.diag(complete.timing).min() > 1e-6


@pytest.mark.parametrize('jitter, sigma', [(0.0001, 0.00033), (0.0015, 0.00495), (0.002, 0.005),
                                           (0.004, 0.005), (0.02, 0.02)])
def test_stamps_err_by_some_milliseconds_and_by_their_jitter(jitter, sigma):
    moved = used().add_to(registration(se3.exp([0.04, 0, 0, 0, 0, 0])),
                          view(1 + PERIOD, jitter), view(1, jitter))
    assert (moved.covariance - OWN)[0, 0] == pytest.approx(2 * sigma ** 2)


def test_errors_of_stamps_are_apart_from_those_of_the_images():
    moved = used().add_to(registration(se3.exp([0.04, 0, 0, 0, 0, 0])),
                          view(1 + PERIOD, 0.004), view(1, 0.004))
    assert moved.timing[0, 0] == pytest.approx(2 * 0.005 ** 2)
    np.testing.assert_allclose(moved.image_pose.covariance, OWN, atol=1e-15)


def test_the_larger_jitter_of_the_two_frames_counts():
    motion = se3.exp([0.01, 0, 0, 0, 0, 0])
    jitters = [(0.004, 0.001), (0.001, 0.004), (0.004, 0.004)]
    covariances = [used().add_to(registration(motion), view(1 + PERIOD, later),
                                 view(1, earlier)).covariance for later, earlier in jitters]
    np.testing.assert_array_equal(covariances[0], covariances[2])
    np.testing.assert_array_equal(covariances[1], covariances[2])


def test_a_lagging_clock_adds_the_change_of_the_motion():
    """Quadratic in the jitter and in the change of speed; nothing where the speed holds."""
    expected, motion = np.eye(4), np.eye(4)
    expected[:3, 3] = 0.02, 0.0, 0.0

    def variance(change, jitter, known=ExpectedPose(expected)):
        motion[:3, 3] = 0.02, change, 0.0
        complete = used().add_to(registration(motion), view(1 + PERIOD, jitter),
                                 view(1, jitter), known)
        return (complete.covariance - OWN)[2, 2]  # along no velocity

    assert variance(0.0, 0.001) == pytest.approx(0.0, abs=1e-15)
    assert variance(0.01, 0.001, None) == pytest.approx(0.0, abs=1e-15)
    one = variance(0.01, 0.001)
    # along each of three axes a third of (delay * change of speed)^2, the delay being 25 jitters
    assert one == pytest.approx((25 * 0.001 * 0.01 / PERIOD) ** 2 / 3)
    assert variance(0.02, 0.001) == pytest.approx(4 * one)
    assert variance(0.01, 0.0005) == pytest.approx(one / 4)
    assert variance(0.01, 0.004) == pytest.approx((0.025 * 0.01 / PERIOD) ** 2 / 3)


def test_the_speed_changes_since_it_was_measured_not_since_the_keyframe():
    """A second after the keyframe, with 1 cm of deviation from constant velocity."""
    jitter, motion = 0.001, se3.exp([0, 0.01, 0, 0, 0, 0])
    source, target = view(2, jitter), view(1, jitter)
    complete = used().add_to(registration(motion), source, target, ExpectedPose(np.eye(4), PERIOD))
    assert (complete.covariance - OWN)[0, 0] == pytest.approx(
        (25 * jitter * 0.01 / PERIOD) ** 2 / 3)


def test_a_delay_that_is_not_certain_adds_its_error_times_the_change_of_the_motion():
    """One camera sees the motion later than the other: the error is along the change alone."""
    sigma, changes = 0.01, np.random.default_rng(2).normal(0, 0.2, 6)
    slow = se3.exp([0.5 * PERIOD, 0, 0, 0, 0, 0])
    fast = se3.perturbed(slow, changes * PERIOD)
    complete = used().add_to(registration(fast), view(1 + PERIOD), view(1),
                             ExpectedPose(slow, PERIOD), delay_sigma=sigma)
    late = [se3.difference(se3.perturbed(fast, sign * sigma * changes), fast)
            for sign in (-1, 1)]
    np.testing.assert_allclose(complete.covariance - OWN,
                               sum(np.outer(error, error) for error in late) / 2, atol=1e-15)


@pytest.mark.parametrize('stamps', [(2, 1), (1, 2)])
def test_the_order_of_the_two_frames_does_not_matter(stamps):
    source, target = (view(seconds, 0.001) for seconds in stamps)
    moved = registration(se3.exp([0, 0.01, 0, 0, 0, 0]))
    complete = used().add_to(moved, source, target, ExpectedPose(np.eye(4), PERIOD))
    assert (complete.covariance - OWN)[0, 0] == pytest.approx(
        (25 * 0.001 * 0.01 / PERIOD) ** 2 / 3)
    assert complete.timing[1, 1] > 2 * (3.3 * 0.001 * 0.01) ** 2


def test_without_a_measured_bias_nothing_is_added():
    alone, model = dataclasses.replace(registration(), bias=None), SystematicError()
    for i in range(5):
        complete = model.add_to(alone, view(1 + i + PERIOD), view(1 + i))
        np.testing.assert_array_equal(complete.covariance, OWN)


def test_a_failed_registration_stays_as_it_is():
    alone = Registration(Status.TOO_FEW_MATCHES, '', np.eye(4), np.diag(6 * [np.inf]),
                         np.empty((0, 2), np.intp), 1)
    assert SystematicError().add_to(alone, view(1.04), view(1)) is alone


def test_infinite_stays_infinite():
    endless = registration(se3.exp([0.01, 0, 0, 0.01, 0, 0]), covariance=np.diag(6 * [np.inf]))
    covariance = SystematicError().add_to(endless, view(1.04, 0.001), view(1)).covariance
    assert np.isinf(np.diag(covariance)).all()
    assert np.isfinite(covariance[~np.eye(6, dtype=bool)]).all()


def test_two_images_with_one_stamp_have_no_speed():
    moved = registration(se3.exp([0.01, 0, 0, 0.01, 0, 0]))
    covariance = used().add_to(moved, view(1, 0.001), view(1), ExpectedPose(np.eye(4))).covariance
    np.testing.assert_array_equal(covariance, OWN)


def test_an_offset_acts_where_motions_by_depth_and_by_colour_differ():
    """Of a camera X beside depth the motion is X^-1 T X: by differences along each of six axes."""
    motion, step = se3.exp(np.array([0.03, -0.05, 0.04, 0.2, -0.1, 0.15])), 1e-6
    offsets = step * np.eye(6)
    by_offset = np.transpose([
        se3.difference(se3.inverse(se3.exp(offset)) @ motion @ se3.exp(offset), motion) / step
        for offset in offsets])
    covariance = np.diag([4e-6, 1e-6, 9e-6, 1e-6, 2e-6, 3e-6])
    gain = np.diag([0.9, 0.8, 0.7, 0.2, 0.3, 0.1])
    expected = gain @ by_offset @ covariance @ by_offset.T @ gain
    np.testing.assert_allclose(errors_of_offset(motion, covariance, gain), expected, rtol=1e-4,
                               atol=1e-5 * np.abs(expected).max())
    assert not errors_of_offset(np.eye(4), covariance, gain).any()


WIDE = Camera(640, 480, 480.0, 480.0, 319.5, 239.5)


def motion_seen(points, motion, longer=1.0, radial=0.0):
    """Return the motion of a camera whose rays are all too steep, by one step on projections."""
    def shown(points):
        square = np.square(points[:, :2] / points[:, 2:]).sum(axis=1, keepdims=True)
        return points * np.hstack([np.tile(longer * (1 + radial * square), 2),
                                   np.ones_like(square)])

    seen, moved = shown(points), shown(se3.transform(motion, points))
    project = np.array([[[1, 0, -x / z], [0, 1, -y / z]] / z for x, y, z in seen])
    jacobian = project @ [np.hstack([np.eye(3), -se3.skew(point)]) for point in seen]
    residuals = moved[:, :2] / moved[:, 2:] - seen[:, :2] / seen[:, 2:]
    return np.linalg.lstsq(jacobian.reshape(-1, 6), residuals.ravel(), rcond=None)[0]


@pytest.mark.parametrize('axis', range(6))
def test_a_focal_length_that_is_too_short_lets_motions_across_the_axis_seem_longer(axis):
    points = np.random.default_rng(1).uniform([-0.2, -0.2, 1.0], [0.2, 0.2, 3.0], (500, 3))
    motion = se3.exp(1e-4 * np.eye(6)[axis])
    off = motion_seen(points, motion, 1.01) - motion_seen(points, motion)
    for gain, errors in ((1.0, np.diag([0.0, 1e-4])), (0.0, np.diag([1e-4, 0.0])),
                         (0.3, np.full((2, 2), 1e-4))):
        np.testing.assert_allclose(
            errors_of_optics(motion, block_diag(errors, 0.0), gain * np.eye(6), WIDE),
            np.outer(off, off), atol=0.05 * 1e-12)


@pytest.mark.parametrize('axis', range(6))
def test_a_lens_that_bends_rays_lets_motions_seem_longer(axis):
    """Along the axis exactly, across it by half to twice as much, as what is seen is distant."""
    rng = np.random.default_rng(1)
    rays = WIDE.normalize(rng.uniform(-0.5, [639.5, 479.5], (4000, 2)))
    points = rng.uniform(0.7, 4.0, (4000, 1)) * np.column_stack([rays, np.ones(len(rays))])
    motion, errors = se3.exp(1e-4 * np.eye(6)[axis]), np.diag([0.0, 0.0, 4e-4])
    off = motion_seen(points, motion, radial=0.02) - motion_seen(points, motion)
    sigma = np.sqrt(errors_of_optics(motion, errors, np.zeros((6, 6)), WIDE)[axis, axis])
    least, most = (0.97, 1.03) if axis == 2 else (0.5, 2.0)
    assert (axis == 5 and off[axis] < 1e-9 > sigma) or least < sigma / off[axis] < most
    assert not errors_of_optics(motion, errors, np.eye(6), WIDE).any()  # depth has another lens


def test_focal_lengths_err_by_what_follows_each():
    motion, gain = se3.exp([0.1, 0, 0.2, 0, 0.05, 0.1]), 0.25 * np.eye(6)
    by_both = errors_of_optics(motion, np.diag([1e-4, 4e-4, 0.0]), gain, WIDE)
    by_one = errors_of_optics(motion, np.diag([1e-4, 0.0, 0.0]), 0 * gain, WIDE)
    np.testing.assert_allclose(by_both, (0.75 ** 2 + 4 * 0.25 ** 2) * by_one)
    errors = block_diag(np.full((2, 2), 1e-4), 0.0)
    assert not errors_of_optics(motion, errors, gain, WIDE)[[2, 5]].any()


def test_all_depths_too_long_by_one_factor_let_the_translation_seem_as_much_longer():
    motion, scale = se3.exp([0.3, -0.1, 0.2, 0.2, -0.1, 0.3]), 1.01
    points = np.random.default_rng(1).uniform([-1.0, -1.0, 1.0], [1.0, 1.0, 3.0], (50, 3))
    seen = motion.copy()
    seen[:3, 3] *= scale
    np.testing.assert_allclose(  # what is seen moves by this motion
        se3.transform(seen, scale * points), scale * se3.transform(motion, points), atol=1e-12)
    np.testing.assert_allclose(
        errors_of_scale(motion[:3, 3], 0.01),
        np.outer(*2 * [se3.difference(seen, motion)]), atol=1e-12)
