# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fused poses by the sum of information, and by a Gaussian of which one value is given."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.pose_fusion import differ, fused, with_measurement


def test_fused_informations_add():
    """Two estimates of one pose: the inverse of the covariance is the sum of the inverses."""
    rng = np.random.default_rng(2)
    roots = 1e-3 * rng.normal(size=(2, 6, 6))
    prior, measured = (PoseWithCovariance(se3.exp(1e-5 * rng.normal(size=6)), root @ root.T)
                       for root in roots)
    informations = [np.linalg.inv(pose.covariance) for pose in (prior, measured)]
    joined = fused(prior, measured)
    np.testing.assert_allclose(np.linalg.inv(joined.covariance), sum(informations), rtol=1e-5,
                               atol=1e-8 * informations[0].max())
    errors = [se3.difference(pose.matrix, joined.matrix) for pose in (prior, measured)]
    pulls = [information @ error for information, error in zip(informations, errors)]
    np.testing.assert_allclose(pulls[0], -pulls[1], rtol=1e-2)  # the weighted mean


def test_a_direction_that_is_measured_exactly_is_known_and_the_rest_follows_by_its_covariance():
    """Of a Gaussian: the mean and covariance of the others, given one of its values."""
    root = 1e-3 * np.random.default_rng(3).normal(size=(6, 6))
    pose = PoseWithCovariance(se3.exp([0.1, -0.2, 0.05, 0.2, 0.1, -0.3]), root @ root.T)
    seen = se3.perturbed(pose.matrix, np.array([9.0, 9.0, 1e-3, 0, 0, 0]))
    joined = with_measurement(pose, seen, np.eye(6)[2:3], np.zeros((1, 1))).pose
    by_z = pose.covariance[:, 2] / pose.covariance[2, 2]
    np.testing.assert_allclose(se3.difference(joined.matrix, pose.matrix), 1e-3 * by_z, atol=1e-9)
    np.testing.assert_allclose(
        joined.covariance, pose.covariance - np.outer(by_z, pose.covariance[2]), atol=1e-15)


@pytest.mark.parametrize('ratio, sigma, are_different', [
    (0.98, 0.01, False), (1.02, 0.01, True), (1.02, 0.02, False)])
def test_poses_differ_by_the_errors_of_both(ratio, sigma, are_different):
    """The 99.9 % quantile of chi-square with six degrees of freedom is 22.46."""
    shift = ratio * np.sqrt(22.46) * np.hypot(0.01, 0.01)
    moved = se3.exp([0.05, 0.02, 0.01, 0.02, 0.1, -0.05])
    one = PoseWithCovariance(moved, 0.01 ** 2 * np.eye(6))
    other = PoseWithCovariance(se3.perturbed(moved, np.array([shift, 0, 0, 0, 0, 0])),
                               sigma ** 2 * np.eye(6))
    assert differ(one, other) == differ(other, one) == are_different
