# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sums of normal equations with a jackknife, against the same computed one by one."""

import numpy as np
import pytest

from aick_ros.registration.refinement.grouped_equations import MEMORY, GroupedEquations

SIZE, GROUPS, RUN = 3, 8, 5
ALL = np.arange(SIZE)
PRIOR = np.diag([2.0, 3.0, 4.0]) + 0.5


def one(rng, value=np.array([1.0, -2.0, 0.5]), noise=0.0):
    """Return information and gradient of a registration that observes two combinations."""
    jacobian = rng.standard_normal((2, SIZE))
    seen = jacobian @ value + noise * rng.standard_normal(2)
    return jacobian.T @ jacobian, jacobian.T @ seen


def added(count, kept=1.0, prior=PRIOR, seed=0, **of):
    """Return sums, and what was added to them."""
    rng = np.random.default_rng(seed)
    sums, items = GroupedEquations(prior, kept), [one(rng, **of) for _ in range(count)]
    for item in items:
        sums.add(*item)
    return sums, items


def solved(items, prior=PRIOR, known=np.zeros(SIZE)):
    information = sum(item[0] for item in items)
    return np.linalg.solve(information + prior,
                           sum(item[1] for item in items) - information @ known)


def test_the_estimate_is_that_of_all_equations_and_the_prior():
    sums, items = added(60, noise=0.3)
    np.testing.assert_allclose(sums.solve(ALL)[0], solved(items))
    known = np.array([0.5, 0.1, -0.2])
    np.testing.assert_allclose(sums.solve(ALL, known)[0], solved(items, known=known))


def test_each_group_has_runs_of_registrations_and_changes_the_estimate_by_what_it_holds():
    sums, items = added(60, noise=0.3)
    estimate, scatter = sums.solve(ALL)
    for group in range(GROUPS):
        others = [item for i, item in enumerate(items) if i // RUN % GROUPS != group]
        np.testing.assert_allclose(estimate + scatter[group], solved(others))
    assert MEMORY == GROUPS * RUN


def test_unknowns_that_are_not_sought_are_zero():
    sums, items = added(60, noise=0.3)
    chosen = np.array([0, 2])
    estimate, scatter = sums.solve(chosen)
    assert estimate[1] == 0.0 and not scatter[:, 1].any()
    information = sum(item[0] for item in items) + PRIOR
    gradient = sum(item[1] for item in items)
    np.testing.assert_allclose(
        estimate[chosen], np.linalg.solve(information[np.ix_(chosen, chosen)], gradient[chosen]))


def test_what_is_old_counts_less_each_time_that_its_group_is_added_to():
    sums, items = added(85, kept=0.5, noise=0.3)
    visits = [(i // RUN) // GROUPS for i in range(85)]
    last = [max(visit for visit, i in zip(visits, range(85)) if i // RUN % GROUPS == group)
            for group in range(GROUPS)]
    weights = [0.5 ** (last[i // RUN % GROUPS] - visit) for i, visit in enumerate(visits)]
    assert sorted(set(weights)) == [0.25, 0.5, 1.0]
    weighted = [(w * item[0], w * item[1]) for w, item in zip(weights, items)]
    np.testing.assert_allclose(sums.solve(ALL)[0], solved(weighted))


@pytest.mark.parametrize('count', [4, 5, 6])
def test_runs_are_of_five(count):
    assert added(count)[0].is_between_runs == (count == 5)


def test_exact_equations_are_significant_and_noise_is_so_as_rarely_as_by_chance():
    """Of unknowns that are zero the ratio has the distribution F(3, 7): above 8.45 in one of a
    hundred."""
    exact, _ = added(80, prior=1e-9 * np.eye(SIZE))
    assert exact.significance(slice(0, SIZE), *exact.solve(ALL)) > 1e6
    found = []
    for seed in range(400):
        sums, _ = added(40, prior=1e-9 * np.eye(SIZE), seed=seed, value=np.zeros(SIZE), noise=1.0)
        found.append(sums.significance(slice(0, SIZE), *sums.solve(ALL)))
    assert np.mean(np.array(found) > 8.45) < 0.03
    assert 0.5 < np.median(found) < 1.5


def test_nothing_is_significant_where_nothing_varies():
    sums = GroupedEquations(PRIOR, 1.0)
    assert sums.significance(slice(0, SIZE), *sums.solve(ALL)) == 0.0


def test_nothing_is_known_where_the_equations_are_not_definite():
    """As where rounding outweighs what the registrations show."""
    sums = GroupedEquations(np.diag([1.0, -1.0, 1.0]), 1.0)
    sums.add(np.zeros((SIZE, SIZE)), np.ones(SIZE))
    estimate, scatter = sums.solve(ALL)
    assert not estimate.any() and np.isposinf(scatter).all()
    assert sums.significance(slice(0, SIZE), estimate, scatter) == 0.0
    assert sums.full_covariance(scatter, 1.0)[0, 0] == np.inf


def test_the_variance_is_that_of_the_errors():
    """Over many repetitions, with the information counted as it is; half of it is the scatter."""
    estimates, variances = [], []
    for seed in range(300):
        sums, _ = added(80, prior=1e-9 * np.eye(SIZE), seed=seed, noise=1.0)
        estimate, scatter = sums.solve(ALL)
        estimates.append(estimate[1])
        variances.append(sums.full_covariance(scatter, 1.0)[1, 1] / 2)
    assert np.mean(variances) / np.var(estimates) == pytest.approx(1.0, abs=0.25)
    sums, _ = added(80, noise=1.0)
    estimate, scatter = sums.solve(ALL)
    one, three = (sums.full_covariance(scatter, effect)[1, 1] for effect in (1.0, 3.0))
    assert (three - one) / 2 == pytest.approx(
        sums.full_covariance(np.zeros_like(scatter), 1.0)[1, 1])
