# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Jitter of the position by keypoints: closed forms and random noise on smooth motions."""

import dataclasses
import itertools

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.refinement.position_jitter import MeanJitter, jitter
from aick_ros.registration.samples import PosesByKind

INTERVAL = 33_000_000  # ns
SIGMA = 0.003  # m


def drive(count, keypoints=0.0, depth=0.0, known=0.0, seed=1, moving_target=False):
    """Return registrations along a curve, with white noise of both kinds [m]."""
    rng = np.random.default_rng(seed)

    def noisy(pose, sigma):
        return se3.perturbed(pose, np.concatenate([sigma * rng.normal(size=3), np.zeros(3)]))

    found = []
    for i in range(count):
        t = i * INTERVAL * 1e-9
        pose = se3.exp((0.3 * np.sin(2 * t), 0.2 * t, 0.1 * np.cos(3 * t),
                        0.2 * np.sin(t), 0.3 * t, 0.1 * np.sin(2 * t)))
        found.append(PosesByKind((10 ** 9 + i * INTERVAL, i * INTERVAL * moving_target),
                                 noisy(pose, keypoints), noisy(pose, depth), known ** 2))
    return found


def shown(registrations):
    """Return the jitter that each three neighbours show [m^2]."""
    return [jitter(*registrations[i:i + 3]) for i in range(len(registrations) - 2)]


def test_a_smooth_motion_shows_no_jitter():
    np.testing.assert_allclose(shown(drive(20)), 0.0, atol=1e-15)


def test_what_scatter_shows_is_not_jitter():
    registrations = drive(3)
    for registration, variance in zip(registrations, (1e-6, 2e-6, 6e-6)):
        object.__setattr__(registration, 'variance', variance)
    assert jitter(*registrations) == pytest.approx(-3e-6)


@pytest.mark.parametrize('moving_target', [False, True])
@pytest.mark.parametrize('depth', [0.0, 0.5 * SIGMA, 3 * SIGMA])
def test_the_jitter_is_that_of_keypoints_whatever_the_noise_of_depth(depth, moving_target):
    found = np.mean(shown(drive(6000, SIGMA, depth, moving_target=moving_target)))
    assert found == pytest.approx(SIGMA ** 2, rel=0.1)


def test_noise_of_depth_alone_is_no_jitter_of_keypoints():
    assert abs(np.mean(shown(drive(6000, depth=SIGMA)))) < 0.01 * SIGMA ** 2


def test_jitter_is_what_scatter_does_not_show():
    found = np.mean(shown(drive(6000, SIGMA, known=0.6 * SIGMA)))
    assert found == pytest.approx(0.64 * SIGMA ** 2, rel=0.15)


@pytest.mark.parametrize('source, target', [
    ((0, 1, 3), (0, 0, 0)), ((0, 2, 3), (0, 0, 0)), ((0, 1, 1), (0, 0, 0)),
    ((2, 1, 0), (0, 0, 0)), ((0, 0, 0), (0, 0, 0)), ((0, 1, 2), (0, 0, 1)),
    ((0, 1, 2), (0, 1, 1)), ((0, 1, 2), (0, 1, 3)), ((0, 1, 2), (1, 0, -1))])
def test_registrations_that_do_not_follow_each_other_show_nothing(source, target):
    registrations = [
        dataclasses.replace(registration, stamps=(10 ** 9 + INTERVAL * a, INTERVAL * b))
        for registration, a, b in zip(drive(3), source, target)]
    assert jitter(*registrations) is None


def test_stamps_may_jitter_a_little():
    registrations = drive(3)
    late = dataclasses.replace(registrations[2], stamps=(
        registrations[2].stamps[0] + INTERVAL // 5, registrations[2].stamps[1]))
    assert jitter(*registrations[:2], late) is not None


def mean_of(samples):
    mean = MeanJitter()
    for one in samples:
        mean = mean.with_sample(one)
    return mean


def test_few_registrations_show_no_jitter():
    assert mean_of([1e-5] * 9).variance == 0.0
    assert mean_of([1e-5] * 10).variance == pytest.approx(1e-5)


def test_no_variance_is_negative():
    assert mean_of([-1e-5] * 100).variance == 0.0


def test_one_absurd_registration_counts_as_two_centimetres():
    assert mean_of([*[0.0] * 29, 1e6]).mean == pytest.approx(0.02 ** 2 / 30)
    assert mean_of([*[0.0] * 29, -1e6]).mean == pytest.approx(-0.02 ** 2 / 30)


def test_a_mean_within_its_error_counts_as_none_and_a_significant_one_almost_whole():
    """The share that is left is 1 - (1.5 standard errors by the mean)^2."""
    for mean, left in ((0.3, 0.0), (1.0, 1 - 1.5 ** 2 * 2 / 30), (4.0, 1 - 1.5 ** 2 * 2 / 480)):
        samples = [1e-6 * (mean + sign) for sign in (1, -1)] * 15
        assert mean_of(samples).variance == pytest.approx(
            1e-6 * mean * left, rel=1e-6, abs=1e-12)


def test_noise_that_scatter_shows_hardly_ever_counts_as_jitter():
    """Of a camera without jitter, over time: the mean that is taken for jitter is small."""
    taken, mean = [], MeanJitter()
    for sample in shown(drive(3000, SIGMA, 0.5 * SIGMA, known=SIGMA)):
        mean = mean.with_sample(sample)
        taken.append(mean.variance)
    assert np.mean(taken) < 0.1 * SIGMA ** 2


def test_a_jitter_that_ends_is_forgotten():
    calm = itertools.repeat(0.0, 120)
    assert mean_of([*[1e-5] * 40, *calm]).variance == 0.0
