# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An error that is there or not: its probability, and what is left once it is corrected."""

import numpy as np
import pytest
from scipy import stats

from aick_ros.registration.refinement.likely_error import LikelyError

SIGMA = 0.02


def drawn(rng, noise, groups):
    """Return an error as likely there as not, and what is estimated of it by groups of data."""
    true = rng.integers(2) * rng.normal(0.0, SIGMA)
    seen = true + rng.normal(0.0, noise * np.sqrt(groups), groups)
    information = SIGMA ** -2 + noise ** -2
    scatter = seen.var(ddof=1) / groups
    return true, LikelyError(seen.mean() * noise ** -2 / information, 1e-12, scatter, groups,
                             SIGMA)


def test_the_probability_is_that_of_bayes_rule():
    """Of an estimate with a variance that is known: the densities with and without an error."""
    for seen, noise in ((0.01, 0.004), (0.002, 0.01), (0.05, 0.01)):
        information = SIGMA ** -2 + noise ** -2
        without = stats.norm.pdf(seen, 0.0, noise)
        with_it = stats.norm.pdf(seen, 0.0, np.hypot(noise, SIGMA))
        error = LikelyError(seen * noise ** -2 / information, 1.0 / information, 0.0, 8, SIGMA)
        assert error.probability == pytest.approx(with_it / (with_it + without), rel=1e-3)


def test_few_groups_that_agree_prove_less_than_many():
    few, many = (LikelyError(0.01, 0.0, 0.002 ** 2, groups, SIGMA).probability
                 for groups in (3, 30))
    assert 0.5 < few < 0.9 < many


@pytest.mark.parametrize('groups', [1, 0])
def test_without_groups_to_compare_nothing_is_known(groups):
    error = LikelyError(0.03, 1e-6, 0.0, groups, SIGMA)
    assert (error.probability, error.corrected) == (0.5, 0.0)


def test_equations_without_a_solution_leave_the_prior():
    error = LikelyError(0.0, np.inf, np.inf, 8, SIGMA)
    assert (error.corrected, error.variance_left) == (0.0, pytest.approx(0.5 * SIGMA ** 2))


@pytest.mark.parametrize('noise', [0.002, 0.01])
def test_correction_leaves_less_than_none_and_as_much_as_is_said(noise):
    rng = np.random.default_rng(1)
    left, said, before = [], [], []
    for true, error in (drawn(rng, noise, 8) for _ in range(4000)):
        left.append((true - error.corrected) ** 2)
        said.append(error.variance_left)
        before.append(true ** 2)
    assert np.mean(left) < 0.6 * np.mean(before)
    assert 0.7 < np.mean(left) / np.mean(said) < 1.2


def test_of_what_is_certain_little_is_wrong():
    rng = np.random.default_rng(2)
    true = np.array([each for each, error in (drawn(rng, 0.004, 8) for _ in range(4000))
                     if error.is_certain])
    assert len(true) > 500
    assert np.mean(true == 0.0) < 0.01
