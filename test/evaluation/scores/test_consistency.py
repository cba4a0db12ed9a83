# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""NEES against scipy, and on errors drawn from the covariance itself."""

import numpy as np
import pytest
from scipy import stats
from scipy.spatial.distance import mahalanobis

from aick_ros.evaluation.scores import consistency
from aick_ros.evaluation.scores.consistency import Consistency, nees
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.geometry import se3

COUNT = 4000


def covariance_of_an_increment(rng):
    """Return a covariance with correlations, a few mm and tenths of a degree, long along x."""
    sigmas = np.array([0.02, 0.002, 0.004, 0.001, 0.006, 0.002])
    mixed = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    correlations = np.eye(6) + 0.3 * mixed @ np.diag([1, -1, 0.5, 0.2, -0.6, -0.1]) @ mixed.T
    return correlations * np.outer(sigmas, sigmas)


def drawn(move):
    """Return the NEES of increments whose truth ``move`` derives from the increment and noise."""
    rng = np.random.default_rng(1)
    values = []
    for _ in range(COUNT):
        covariance = covariance_of_an_increment(rng)
        increment = se3.exp(rng.normal(0, 0.5, 6))
        noise = rng.multivariate_normal(np.zeros(6), covariance)
        values.append(IncrementError.of(increment, covariance, move(increment, noise)).nees)
    return values


def about_fixed_axes(increment, noise):
    """Return [exp(theta) R, p + delta], the error model of geometry_msgs."""
    truth = np.eye(4)
    truth[:3, :3] = se3.exp_rotation(noise[3:]) @ increment[:3, :3]
    truth[:3, 3] = increment[:3, 3] + noise[:3]
    return truth


def test_constants_and_density_are_those_of_scipy():
    right = stats.chi2(6)
    assert consistency.DOF == 6
    assert consistency.QUANTILE_95 == pytest.approx(right.ppf(0.95), rel=1e-12)
    assert consistency.QUANTILE_997 == pytest.approx(right.ppf(0.997), rel=1e-12)
    values = np.linspace(0, 40, 81)
    np.testing.assert_allclose(consistency.density(values), right.pdf(values), atol=1e-15)


def test_right_covariances_are_called_right():
    values = drawn(about_fixed_axes)
    score = Consistency.of(values)
    # five standard deviations of the means of so many
    assert score.nees_mean == pytest.approx(6, abs=5 * (12 / COUNT) ** 0.5)
    assert score.inside_95 == pytest.approx(0.95, abs=5 * (0.95 * 0.05 / COUNT) ** 0.5)
    assert score.inside_997 == pytest.approx(0.997, abs=5 * (0.997 * 0.003 / COUNT) ** 0.5)
    assert stats.kstest(values, stats.chi2(6).cdf).pvalue > 1e-3


def test_covariances_about_other_axes_are_found_out():
    score = Consistency.of(drawn(lambda increment, noise: increment @ se3.exp(noise)))
    assert score.nees_mean > 12
    assert score.inside_95 < 0.9


def test_nees_is_the_mahalanobis_distance_squared():
    rng = np.random.default_rng(2)
    for _ in range(20):
        covariance, error = covariance_of_an_increment(rng), rng.normal(0, 0.01, 6)
        expected = mahalanobis(error, np.zeros(6), np.linalg.inv(covariance)) ** 2
        assert nees(error, covariance) == pytest.approx(expected, rel=1e-9)
    millimetres = np.diag([1e-12, 1e-12, 1e-12, 1e6, 1e6, 1e6])
    assert nees(np.full(6, 1e-6), millimetres) == pytest.approx(3, rel=1e-9)


@pytest.mark.parametrize('bad', [np.inf, np.nan])
def test_a_covariance_that_promises_nothing_does_not_enter(bad):
    covariance = np.eye(6)
    covariance[2, 2] = bad
    assert nees(np.ones(6), covariance) is None
    assert Consistency.of([None, 3.0, None]) == Consistency(3.0, 6, 1.0, 1.0)


@pytest.mark.parametrize('covariance', [
    np.zeros((6, 6)), np.ones((6, 6)), np.diag([1, 1, 1, 1, 1, 0]), np.diag([1, 1, 1, 1, 1, -1])])
def test_a_covariance_that_promises_too_much_is_outside(covariance):
    assert nees(np.full(6, 1e-3) * np.arange(6), covariance.astype(float)) == np.inf
    assert Consistency.of([np.inf, 5.0, 15.0, 7.0]) == Consistency(9.0, 6, 0.5, 0.75)
    assert Consistency.of([np.inf]) == Consistency(None, 6, 0.0, 0.0)


@pytest.mark.parametrize('dof', [3, 6])
def test_the_shares_are_those_inside_the_quantiles_of_scipy(dof):
    inner, outer = stats.chi2(dof).ppf([0.95, 0.997])
    score = Consistency.of([inner - 1e-9, inner + 1e-9, outer - 1e-9, outer + 1e-9], dof)
    assert (score.dof, score.inside_95, score.inside_997) == (dof, 0.25, 0.75)


def test_there_is_no_consistency_of_nothing():
    assert Consistency.of([]) == Consistency.of([None]) == Consistency(None, 6, None, None)
