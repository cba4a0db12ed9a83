# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The update against the information form, NumPy and samples; propagation against NumPy."""

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros import kernels
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES, KalmanUpdate, measured, propagated


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


@pytest.mark.parametrize('count', [3, 6, 12])
def test_one_of_a_thousand_updates_is_beyond_the_largest_distance(count):
    assert LARGEST_SQUARED_DISTANCES[count] == pytest.approx(chi2.ppf(0.999, count), abs=0.005)


@pytest.mark.parametrize('size, count', [(1, 1), (6, 2), (6, 6), (12, 3), (2, 5), (32, 32)])
def test_updates_of_any_size_are_those_of_numpy(size, count):
    rng = np.random.default_rng(size + count)
    a, b, rows = (rng.normal(size=shape) for shape in (
        (size, size), (count, count), (count, size)))
    covariance, noise = a @ a.T, b @ b.T + np.eye(count)
    expected = rows @ covariance @ rows.T + noise
    gain = covariance @ rows.T @ np.linalg.inv(expected)
    kept = np.eye(size) - gain @ rows
    update = KalmanUpdate.of(covariance, rows, noise)
    for found, right in ((update.expected, expected), (update.gain, gain), (update.kept, kept),
                         (update.covariance, kept @ covariance)):
        np.testing.assert_allclose(found, right, rtol=1e-9, atol=1e-9 * abs(right).max())


def test_matrices_may_be_parts_of_larger_ones(problem):
    covariance, rows, noise = problem
    parts = [np.repeat(matrix, 2, axis=0)[::2].T.copy().T for matrix in problem]
    for found, right in zip(vars(KalmanUpdate.of(*parts)).values(),
                            vars(KalmanUpdate.of(covariance, rows, noise)).values()):
        np.testing.assert_array_equal(found, right)


def test_where_the_difference_has_no_covariance_the_gain_is_that_of_numpy(problem):
    covariance, rows, noise = problem
    update = KalmanUpdate.of(covariance, rows, -4.0 * noise - rows @ covariance @ rows.T)
    np.testing.assert_allclose(update.gain, covariance @ rows.T @ np.linalg.inv(-4.0 * noise))
    np.testing.assert_allclose(update.kept, np.eye(4) - update.gain @ rows)


@pytest.mark.parametrize('size, count', [(1, 1), (6, 3), (12, 1), (12, 3), (32, 32)])
def test_an_estimate_that_is_measured_is_that_of_the_information_form(size, count):
    rng = np.random.default_rng(size + count)
    a, b, rows = (rng.normal(size=shape) for shape in (
        (size, size), (count, count), (count, size)))
    covariance, noise = a @ a.T + np.eye(size), b @ b.T + np.eye(count)
    values, readings = rng.normal(size=size), rng.normal(size=count)
    found, its_covariance = measured(values, covariance, rows, noise, readings - rows @ values)
    information = np.linalg.inv(covariance) + rows.T @ np.linalg.inv(noise) @ rows
    np.testing.assert_allclose(its_covariance, np.linalg.inv(information), atol=1e-9)
    right = np.linalg.solve(information, np.linalg.inv(covariance) @ values
                            + rows.T @ np.linalg.inv(noise) @ readings)
    np.testing.assert_allclose(found, right, atol=1e-9)
    np.testing.assert_array_equal(its_covariance, its_covariance.T)


def test_a_measurement_too_far_away_is_none(problem):
    covariance, rows, noise = problem
    error = np.array([3.0, -1.0])
    distance = error @ np.linalg.inv(rows @ covariance @ rows.T + noise) @ error
    assert measured(np.zeros(4), covariance, rows, noise, error, 1.001 * distance) is not None
    assert measured(np.zeros(4), covariance, rows, noise, error, 0.999 * distance) is None


@pytest.mark.parametrize('covariance, noise', [
    (np.zeros((4, 4)), np.zeros((2, 2))), (np.eye(4), -9.0 * np.eye(2)),
    (np.full((4, 4), np.nan), np.eye(2))])
def test_a_measurement_whose_error_has_no_covariance_is_none(covariance, noise):
    rows, values = np.eye(2, 4), np.arange(4.0)
    assert measured(values, covariance, rows, noise, np.ones(2)) is None
    np.testing.assert_array_equal(values, np.arange(4.0))


@pytest.mark.parametrize('size, count', [(1, 1), (3, 0), (6, 3), (12, 3), (32, 32)])
def test_propagation_is_that_of_numpy(size, count):
    rng = np.random.default_rng(size)
    transition, influence = rng.normal(size=(size, size)), rng.normal(size=(size, count))
    a, b = rng.normal(size=(size, size)), rng.normal(size=(count, count))
    found = propagated(transition, a @ a.T, influence, b @ b.T)
    moved, added = transition @ a, influence @ b
    np.testing.assert_allclose(found, moved @ moved.T + added @ added.T, atol=1e-9)
    np.testing.assert_array_equal(found, found.T)


def test_matrices_that_do_not_fit_are_refused(problem):
    covariance, rows, noise = problem
    for wrong in ((covariance[:3], rows, noise), (covariance, rows[:, :3], noise),
                  (covariance, rows, noise[:, :1])):
        with pytest.raises(ValueError, match='are required'):
            KalmanUpdate.of(*wrong)
        with pytest.raises(ValueError, match='are required'):
            propagated(covariance, wrong[0], wrong[1].T, wrong[2])
        with pytest.raises(ValueError, match='are required'):
            measured(np.zeros(4), *wrong, np.zeros(2))
    with pytest.raises(ValueError, match='6 numbers: 8 are required'):
        kernels.kalman_update(covariance, rows, noise, np.empty((2, 2)), np.empty((3, 2)),
                              np.empty((4, 4)), np.empty((4, 4)))


def test_too_many_values_are_refused():
    for size, count in ((33, 1), (1, 33)):
        rows, noise = np.zeros((count, size)), np.eye(count)
        with pytest.raises(ValueError, match='at most 32 values'):
            KalmanUpdate.of(np.eye(size), rows, noise)
        with pytest.raises(ValueError, match='at most 32 values'):
            propagated(np.eye(size), np.eye(size), rows.T, noise)
        with pytest.raises(ValueError, match='at most 32 values'):
            measured(np.zeros(size), np.eye(size), rows, noise, np.zeros(count))
