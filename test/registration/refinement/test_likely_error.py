# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors that are there or not: their probability, and what is left once they are corrected."""

import numpy as np
import pytest
from scipy import stats

from aick_ros.registration.refinement.likely_error import LikelyError, LikelyErrors

SIGMA = 0.02


def alone(*arguments):
    return LikelyErrors([LikelyError.of(*arguments)])


def drawn(rng, noise, groups, size=1):
    """Return errors as likely there as not, and what is estimated of them by groups of data."""
    true = rng.integers(2) * (rng.random(size) < 0.8) * rng.normal(0.0, SIGMA, size)
    seen = true + rng.normal(0.0, noise * np.sqrt(groups), (groups, size))
    return true, LikelyErrors([
        LikelyError.of(mean, 1e-12, variance / groups, groups, SIGMA)
        for mean, variance in zip(seen.mean(0), seen.var(0, ddof=1))])


def test_the_probability_is_that_of_bayes_rule():
    """Of an estimate with a variance that is known: the densities with and without an error."""
    for seen, noise in ((0.01, 0.004), (0.002, 0.01), (0.05, 0.01)):
        information = SIGMA ** -2 + noise ** -2
        without = stats.norm.pdf(seen, 0.0, noise)
        with_it = stats.norm.pdf(seen, 0.0, np.hypot(noise, SIGMA))
        error = alone(seen * noise ** -2 / information, 1.0 / information, 0.0, 8, SIGMA)
        any_of = 0.2 * without + 0.8 * with_it
        assert error.probability == pytest.approx(any_of / (any_of + without), rel=1e-3)
        assert error.probabilities == pytest.approx(
            0.8 * with_it / (any_of + without), rel=1e-3)


def test_few_groups_that_agree_prove_less_than_many():
    few, many = (alone(0.01, 1e-12, 0.002 ** 2, groups, SIGMA).probability for groups in (3, 30))
    assert 0.5 < few < 0.9 < many


@pytest.mark.parametrize('groups', [2, 1, 0])
def test_without_groups_to_compare_nothing_is_known(groups):
    error = alone(0.03, 1e-6, 0.0, groups, SIGMA)
    assert (error.probability, error.corrected) == (pytest.approx(0.5), 0.0)
    assert error.variances_left == pytest.approx(0.4 * SIGMA ** 2)


def test_equations_without_a_solution_leave_the_prior():
    error = alone(0.0, np.inf, np.inf, 8, SIGMA)
    assert (error.corrected, error.variances_left) == (0.0, pytest.approx(0.4 * SIGMA ** 2))


@pytest.mark.parametrize('size', [1, 3])
@pytest.mark.parametrize('noise', [0.002, 0.01])
def test_correction_leaves_less_than_none_and_as_much_as_is_said(noise, size):
    rng = np.random.default_rng(1)
    left, said, before = [], [], []
    for true, errors in (drawn(rng, noise, 8, size) for _ in range(3000)):
        left.append((true - errors.corrected) ** 2)
        said.append(errors.variances_left)
        before.append(true ** 2)
    assert np.mean(left) < 0.6 * np.mean(before)
    assert 0.7 < np.mean(left) / np.mean(said) < 1.1


def test_what_is_corrected_of_none_is_within_what_is_said():
    """Where errors are likely though there are none."""
    rng, left, said = np.random.default_rng(3), [], []
    for _ in range(4000):
        true, errors = drawn(rng, 0.01, 8)
        if errors.corrected.any() and errors.probability < 0.8:
            left.append((true - errors.corrected) ** 2)
            said.append(errors.variances_left)
    assert len(left) > 300
    assert 0.7 < np.mean(left) / np.mean(said) < 1.1


def test_of_what_is_certain_little_is_wrong():
    rng = np.random.default_rng(2)
    true = np.array([each for each, errors in (drawn(rng, 0.004, 8) for _ in range(5000))
                     if errors.are_certain.all()])
    assert len(true) > 500
    assert np.mean(true == 0.0) < 0.01


def test_one_that_is_certain_makes_the_others_likely():
    """As of a delay and two readouts: a delay that is corrected alone may be worse than none."""
    delay, readout = (LikelyError.of(mean, 0.006 ** 2, 1e-8, 8, SIGMA) for mean in (0.04, 0.006))
    assert not LikelyErrors([readout, readout]).corrected.any()
    both = LikelyErrors([delay, readout])
    assert both.corrected[0] == pytest.approx(delay.mean, rel=0.01)
    assert 0.5 * readout.mean < both.corrected[1] < 0.9 * readout.mean


def test_one_that_is_there_alone_is_found_beside_others_that_are_not():
    delay, none = (LikelyError.of(mean, 0.002 ** 2, 1e-8, 8, SIGMA) for mean in (0.02, 0.0))
    found = LikelyErrors([none, delay, none])
    np.testing.assert_array_equal(found.are_certain, [False, True, False])
    assert found.corrected[1] == pytest.approx(delay.mean, rel=0.01)


def test_groups_that_contradict_each_other_show_nothing():
    """However large their mean is beside the prior."""
    error = alone(0.02, 1e-6, (4 * SIGMA) ** 2, 8, SIGMA)
    assert error.corrected == 0.0
    assert error.variances_left < SIGMA ** 2


@pytest.mark.parametrize('known, scatter', [(1.0, 0.5), (0.2, 1.0)])
def test_the_larger_of_variance_and_scatter_is_the_noise_of_the_data(known, scatter):
    """The mean is that of data as noisy as the prior: half of what they show."""
    variance = SIGMA ** 2 * known / (1.0 + known)
    by_data = 1.0 - variance / SIGMA ** 2
    error = LikelyError.of(0.05 * by_data, variance, scatter * (SIGMA * by_data) ** 2, 8, SIGMA)
    assert error.mean == pytest.approx(0.025)
    assert error.variance == pytest.approx(0.5 * SIGMA ** 2)
