# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The update against the information form, and against samples."""

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCE, KalmanUpdate


@pytest.fixture
def problem():
    """Return covariance, rows and noise of two measurements of four values."""
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(4, 4)), rng.normal(size=(2, 2))
    return a @ a.T + np.eye(4), rng.normal(size=(2, 4)), b @ b.T + np.eye(2)


def test_information_adds_up(problem):
    covariance, rows, noise = problem
    update = KalmanUpdate.of(covariance, rows, noise)
    information = np.linalg.inv(covariance) + rows.T @ np.linalg.inv(noise) @ rows
    np.testing.assert_allclose(update.covariance, np.linalg.inv(information), rtol=1e-9)
    np.testing.assert_allclose(
        update.gain, update.covariance @ rows.T @ np.linalg.inv(noise), rtol=1e-9)
    np.testing.assert_allclose(update.kept @ covariance, update.covariance, rtol=1e-9)


def test_the_errors_of_samples_have_the_covariances_returned(problem):
    covariance, rows, noise = problem
    update, rng = KalmanUpdate.of(covariance, rows, noise), np.random.default_rng(2)
    errors = rng.multivariate_normal(np.zeros(4), covariance, 100_000)
    measured = rng.multivariate_normal(np.zeros(2), noise, 100_000)
    differences = measured - errors @ rows.T  # the true values are zero
    left = errors + differences @ update.gain.T
    np.testing.assert_allclose(np.cov(left.T), update.covariance, atol=0.05)
    distances = [update.squared_distance(difference) for difference in differences[:20_000]]
    assert np.mean(distances) == pytest.approx(2.0, rel=0.03)


def test_an_exact_measurement_leaves_no_error_along_its_rows(problem):
    covariance, rows, _ = problem
    update = KalmanUpdate.of(covariance, rows, np.zeros((2, 2)))
    np.testing.assert_allclose(rows @ update.covariance, 0.0, atol=1e-12)


def test_the_difference_has_the_covariance_of_both(problem):
    covariance, rows, noise = problem
    np.testing.assert_allclose(KalmanUpdate.of(covariance, rows, noise).expected,
                               rows @ covariance @ rows.T + noise, rtol=1e-12)


def test_covariances_stay_symmetric_to_the_last_bit(problem):
    """Over many updates what rounding leaves would grow."""
    covariance, rows, noise = problem
    for _ in range(20):
        covariance = KalmanUpdate.of(covariance, rows, noise).covariance
        np.testing.assert_array_equal(covariance, covariance.T)


def test_one_of_a_thousand_updates_by_three_values_is_beyond_the_largest_distance():
    assert chi2.sf(LARGEST_SQUARED_DISTANCE, 3) == pytest.approx(0.001, rel=0.03)
