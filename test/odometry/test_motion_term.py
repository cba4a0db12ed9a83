# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Terms of other sensors against the minimum of the whole least-squares problem."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.motion_term import ROTATION, MotionTerm

RNG = np.random.default_rng(4)
SEEN = PoseWithCovariance(se3.exp([0.1, -0.2, 0.05, 0.2, 0.1, -0.3]), np.cov(
    np.diag([4e-3, 3e-3, 5e-3, 2e-3, 3e-3, 4e-3]) @ RNG.standard_normal((6, 30))))


def measured(error):
    return se3.perturbed(SEEN.matrix, np.asarray(error))


TERMS = [MotionTerm(measured([9, 9, 9, 0.004, -0.003, 0.002]), ROTATION, 1e-6 * np.eye(3)),
         MotionTerm(measured([0.01, -0.02, 0.01, 0.01, 0.01, -0.01]), np.eye(6),
                    np.diag([1e-4, 1e-5, 1e-4, 1e-6, 1e-5, 1e-4])),
         MotionTerm(measured([0.0, 0.0, 0.03, 0, 0, 0]), np.eye(6)[2:3], np.array([[1e-6]]))]


def minimum(term):
    """Return the minimum of both sums of squares by Gauss-Newton with numeric derivatives."""
    whiten = [np.linalg.inv(np.linalg.cholesky(c)) for c in (SEEN.covariance, term.covariance)]

    def residuals(x):
        pose = measured(x)
        return np.concatenate([whiten[0] @ se3.difference(SEEN.matrix, pose), whiten[1] @ (
            term.rows @ se3.difference(term.T_target_source, pose))])

    x = np.zeros(6)
    for _ in range(8):
        J = np.column_stack([(residuals(x + h) - residuals(x - h)) / 2e-6
                             for h in 1e-6 * np.eye(6)])
        x = x - np.linalg.lstsq(J, residuals(x), rcond=None)[0]
    return x, np.linalg.inv(J.T @ J)


@pytest.mark.parametrize('term', TERMS)
def test_the_pose_is_the_minimum_with_its_curvature(term):
    x, covariance = minimum(term)
    fused = term.added_to(SEEN).pose
    sigmas = np.sqrt(np.diag(covariance))
    assert (np.abs(se3.difference(fused.matrix, measured(x))) < 0.05 * sigmas).all()
    assert np.allclose(fused.covariance / np.outer(sigmas, sigmas),
                       covariance / np.outer(sigmas, sigmas), atol=0.02)


@pytest.mark.parametrize('term', TERMS)
def test_what_is_kept_and_what_is_new_make_the_covariance(term):
    fusion = term.added_to(SEEN)
    kept = fusion.update.kept
    gain = (np.eye(6) - kept) @ np.linalg.pinv(term.rows)
    assert np.allclose(kept @ SEEN.covariance @ kept.T + gain @ term.covariance @ gain.T,
                       fusion.pose.covariance)


def test_the_squared_distance_of_noise_is_the_number_of_rows_in_the_mean():
    rng, squares = np.random.default_rng(1), []
    for _ in range(400):
        error = rng.multivariate_normal(np.zeros(3), SEEN.covariance[3:, 3:] + 1e-6 * np.eye(3))
        squares.append(MotionTerm(measured([1, 2, 3, *error]), ROTATION,
                                  1e-6 * np.eye(3)).added_to(SEEN).squared_distance)
    assert 2.61 < np.mean(squares) < 3.42  # chi-squared of 1200, by 400: once in a thousand


@pytest.mark.parametrize('rows', [ROTATION, np.eye(6)])
def test_noise_agrees_999_times_of_1000_however_many_rows_are_measured(rows):
    """The squared distance along one row, at its limit."""
    limit = chi2.ppf(0.999, len(rows))
    term = MotionTerm(SEEN.matrix, rows, 1e-6 * np.eye(len(rows)))
    expected = rows @ SEEN.covariance @ rows.T + term.covariance
    step = np.linalg.cholesky(expected)[:, 0]
    for factor, agrees in ((0.99, True), (1.01, False)):
        deviation = rows.T @ (factor * np.sqrt(limit) * step)
        moved = dataclasses.replace(term, T_target_source=se3.perturbed(SEEN.matrix, deviation))
        assert moved.added_to(SEEN).is_of_noise == agrees
