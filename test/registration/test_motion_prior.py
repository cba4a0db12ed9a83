# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The motion expected as a prior."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.motion_prior import MotionPrior
from aick_ros.settings import OdometrySettings

ELAPSED = 0.1  # s
EXPECTED = ExpectedPose(se3.exp([0.05, 0.02, 0.01, 0.02, 0.1, -0.05]), ELAPSED)
PRIOR = MotionPrior(OdometrySettings(acceleration_sigma=3.0, angular_acceleration_sigma=15.0))
SIGMA = 0.5 * 5.0 * ELAPSED ** 2  # m, of the prior: 5/3 of 3 m/s^2
QUANTILE = 4.74  # sqrt of the 99.9 % quantile of chi-square with six degrees of freedom


def off(shift, sigma=1e-6):
    """Return the pose expected, moved along x [m]."""
    return PoseWithCovariance(se3.perturbed(
        EXPECTED.T_target_source, np.array([shift, 0, 0, 0, 0, 0])), sigma ** 2 * np.eye(6))


def test_its_covariance_is_that_of_an_acceleration_since_the_velocity_was_measured():
    prior = PRIOR.of(EXPECTED)
    assert prior.matrix is EXPECTED.T_target_source
    np.testing.assert_allclose(np.sqrt(np.diagonal(prior.covariance)),
                               3 * [SIGMA] + 3 * [0.5 * 15.0 * ELAPSED ** 2])


def test_errors_of_stamps_are_a_part_of_its_covariance():
    prior = PRIOR.of(ExpectedPose(np.eye(4), ELAPSED, timing=(0.03, 0.4)))
    np.testing.assert_allclose(np.diagonal(prior.covariance - PRIOR.of(EXPECTED).covariance),
                               np.repeat([0.03, 0.4], 3) ** 2)


@pytest.mark.parametrize('elapsed', [1e-6, 0.001, 0.005])
def test_stamps_of_a_burst_make_it_no_measurement(elapsed):
    """Of images whose stamps are less than 5 ms apart the motion is expected over 5 ms."""
    prior = PRIOR.of(ExpectedPose(np.eye(4), elapsed))
    np.testing.assert_allclose(np.sqrt(np.diagonal(prior.covariance)),
                               3 * [0.5 * 5.0 * 0.005 ** 2] + 3 * [0.5 * 15.0 * 0.005 ** 2])


def test_it_does_not_grow_for_ever():
    covariances = [PRIOR.of(ExpectedPose(np.eye(4), elapsed)).covariance
                   for elapsed in (10.0, np.inf)]
    np.testing.assert_array_equal(*covariances)


@pytest.mark.parametrize('ratio, is_exceeded', [(0.98, False), (1.02, True)])
def test_a_pose_exceeds_it_by_more_than_noise(ratio, is_exceeded):
    assert PRIOR.is_exceeded_by(off(ratio * QUANTILE * SIGMA), EXPECTED) == is_exceeded


@pytest.mark.parametrize('pose, other, sigma, is_continued', [
    (0.0, 2.0, 1e-6, True), (0.0, 0.9, 1e-6, False), (1.1, 2.0, 1e-6, False),
    (0.9, 1.1, 0.01, False)],
    ids=['by one', 'by both', 'by neither', 'they do not differ'])
def test_one_of_two_poses_continues_the_motion(pose, other, sigma, is_continued):
    limit = QUANTILE * SIGMA
    one = off(pose * limit, sigma)
    assert PRIOR.is_continued_by(one, off(other * limit), EXPECTED) == is_continued
