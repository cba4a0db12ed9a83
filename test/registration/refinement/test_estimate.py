# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Estimates by one sensor against sums over its residuals and explicit matrices."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.registration.refinement.estimate import Estimate, joint_estimate
from aick_ros.registration.refinement.mean_scatter import SHARE
from aick_ros.registration.refinement.residuals import Residuals, curvature, gradient_noise

PRIOR = np.eye(6)
NO_BIAS = np.zeros((6, 6))


def residuals(seed, count=60):
    rng = np.random.default_rng(seed)
    return Residuals(rng.normal(size=count), rng.normal(size=(count, 6)),
                     rng.uniform(0.1, 1.0, count), rng.integers(0, 20, count))


def scaled(kind, factor):
    """Return residuals with values that are larger by a factor."""
    return dataclasses.replace(kind, values=factor * kind.values)


def sums(kinds):
    """Return information and gradient of some residuals."""
    return (sum(((kind.jacobian.T * kind.weights) @ kind.jacobian for kind in kinds), NO_BIAS),
            sum(((kind.jacobian.T * kind.weights) @ kind.values for kind in kinds), np.zeros(6)))


def scatter_of(kinds, error):
    """Return the covariance of the gradient by what an error leaves of some residuals."""
    return gradient_noise([dataclasses.replace(kind, values=kind.values - kind.jacobian @ error)
                           for kind in kinds])


@pytest.mark.parametrize('count', [0, 1, 2])
def test_an_estimate_is_the_least_squares_fit_with_the_scatter_about_it(count):
    kinds = [residuals(1), residuals(2, 25)][:count]
    information, gradient = sums(kinds)
    inverse = np.linalg.inv(information + PRIOR)
    scatter = scatter_of(kinds, inverse @ gradient)
    found = Estimate.of(kinds, 0.4, NO_BIAS)
    np.testing.assert_allclose(found.error, inverse @ gradient, atol=1e-14)
    np.testing.assert_allclose(found.covariance, inverse @ (scatter + PRIOR) @ inverse,
                               rtol=1e-9, atol=1e-14)
    assert found.design_effect == pytest.approx(np.trace(inverse @ (scatter + PRIOR)) / 6)
    np.testing.assert_allclose(found.marginal.information, 0.4 * information, rtol=1e-12)
    np.testing.assert_allclose(found.marginal.gradient, 0.4 * gradient, rtol=1e-12)
    np.testing.assert_allclose(found.scatter, 0.16 * scatter, rtol=1e-9, atol=1e-9)
    assert found.curvature == curvature(kinds)


@pytest.mark.parametrize('directions', [0, 2, 6])
def test_a_bias_is_marginalised(directions):
    """As the Schur complement of a problem with it as unknowns, also in some directions only."""
    kinds = [residuals(7, 30)]
    deviations = 0.3 * np.random.default_rng(8).normal(size=6) * (np.arange(6) < directions)
    root = np.diag(deviations)[:, :directions]
    information, slopes = sums(kinds)
    noise = scatter_of(kinds, np.linalg.solve(information + PRIOR, slopes))
    j, g = 0.4 * information, 0.4 * slopes
    # unknowns: the error of the pose, and the bias in units of its standard deviations
    both = np.block([[j, j @ root], [root.T @ j, root.T @ j @ root + np.eye(directions)]])
    gradient = np.concatenate([g, root.T @ g])
    gains = np.linalg.solve(both[6:, 6:], both[6:, :6]).T
    found = Estimate.of(kinds, 0.4, np.diag(deviations ** 2))
    np.testing.assert_allclose(found.marginal.information, both[:6, :6] - gains @ both[6:, :6],
                               rtol=1e-7)
    np.testing.assert_allclose(found.marginal.gradient, gradient[:6] - gains @ gradient[6:],
                               rtol=1e-7)
    gain = 0.4 * (np.eye(6) - gains @ root.T)
    np.testing.assert_allclose(found.scatter, gain @ noise @ gain.T, rtol=1e-7, atol=1e-12)


def test_scatter_has_most_of_its_shape_from_the_mean_and_all_of_its_scale_from_the_residuals():
    kinds, rng = [residuals(7, 30)], np.random.default_rng(3)
    root = rng.normal(size=(6, 6))
    shape = root @ root.T * 6 / np.trace(root @ root.T)
    information, gradient = sums(kinds)
    inverse = np.linalg.inv(information + PRIOR)
    plain, found = Estimate.of(kinds, 0.4, NO_BIAS), Estimate.of(kinds, 0.4, NO_BIAS, shape)
    factor = np.linalg.cholesky(information + PRIOR)
    noise = scatter_of(kinds, inverse @ gradient)
    for each in (plain, found):
        np.testing.assert_allclose(factor @ each.shown @ factor.T, noise, rtol=1e-9, atol=1e-10)
    scale = np.trace(inverse @ noise) / 6
    assert np.trace(found.shown) / 6 == pytest.approx(scale)
    expected = (1 - SHARE) * noise + SHARE * scale * factor @ shape @ factor.T
    np.testing.assert_allclose(found.scatter, 0.16 * expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.expected_covariance, inverse @ (expected + PRIOR) @ inverse,
                               rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(found.covariance, plain.covariance)
    np.testing.assert_allclose(plain.expected_covariance, plain.covariance, rtol=1e-9)
    assert found.design_effect == plain.design_effect
    np.testing.assert_array_equal(found.error, plain.error)


def test_a_bias_has_a_covariance_of_six_directions():
    with pytest.raises(ValueError, match='the bias has 9 numbers: 36 are required'):
        Estimate.of([residuals(7)], 1.0, np.eye(3))
    for no_bias in (-1.0, np.nan):
        found = Estimate.of([residuals(7)], 1.0, no_bias * np.eye(6))
        assert np.isnan(found.marginal.information).all()


def test_residuals_that_are_no_numbers_have_no_estimate():
    found = Estimate.of([Residuals(np.ones(2), np.full((2, 6), np.nan), np.ones(2),
                                   np.zeros(2, np.int64))], 1.0, NO_BIAS)
    assert np.isnan(found.error).all() and np.isnan(found.covariance).all()


@pytest.mark.parametrize('name', ['jacobian', 'weights', 'blocks'])
@pytest.mark.parametrize('at, other', [(0, ''), (1, 'other ')])
def test_residuals_have_a_row_for_each_value(name, at, other):
    kinds = [residuals(1), residuals(2)]
    kinds[at] = dataclasses.replace(kinds[at], **{name: getattr(kinds[at], name)[1:]})
    with pytest.raises(ValueError, match=f'the {other}{name} has .* numbers: .* are required'):
        Estimate.of(kinds, 1.0, NO_BIAS)


@pytest.mark.parametrize('scale, added', [(1.0, 0.0), (0.0, 0.01)])
@pytest.mark.parametrize('kinds', [1, 2])
def test_the_joint_estimate_is_that_of_the_sums_with_the_prior_once(kinds, scale, added):
    """
    Also of one sensor, where the other one has no residuals.

    Residuals that vanish are no measurement without an error.
    """
    rng = np.random.default_rng(9)
    pose, root = se3.exp(rng.normal(size=6)), rng.normal(size=(6, 6))
    ones = [Estimate.of([scaled(residuals(seed), scale)][:seed <= kinds], weight,
                        0.01 * np.diag(rng.uniform(size=6)))
            for seed, weight in ((1, 0.3), (2, 1.0))]
    information = sum(one.marginal.information for one in ones)
    inverse = np.linalg.inv(information + PRIOR)
    scatter = sum(one.scatter for one in ones) + added * information + PRIOR
    found, covariance, gain = joint_estimate(*ones, pose, root @ root.T)
    np.testing.assert_allclose(found, se3.perturbed(pose, -inverse @ sum(
        one.marginal.gradient for one in ones)), atol=1e-12)
    curved = np.linalg.inv(PRIOR + sum(one.curvature * one.marginal.information for one in ones))
    np.testing.assert_allclose(covariance, curved @ scatter @ curved + root @ root.T,
                               rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(gain, inverse @ ones[1].marginal.information, rtol=1e-9,
                               atol=1e-12)


def test_small_scatter_is_raised_to_a_share_of_the_information_and_no_more():
    """In the mean over the unknowns; scatter that is larger is left as it is."""
    effects = []
    for scale in (0.05, 0.09, 0.3):
        ones = [Estimate.of([scaled(residuals(seed), scale)], 1.0, NO_BIAS) for seed in (1, 2)]
        information = sum(one.marginal.information for one in ones)
        flat = [dataclasses.replace(one, curvature=1.0) for one in ones]
        _, covariance, _ = joint_estimate(*flat, np.eye(4), NO_BIAS)
        shown = sum(one.scatter for one in ones)
        effects.append([np.trace(each) / 6 for each in (
            np.linalg.solve(information + PRIOR, shown),
            (information + PRIOR) @ covariance - np.linalg.inv(information + PRIOR) @ PRIOR)])
    effects = np.array(effects)
    assert effects[0, 0] < 0.01 < effects[2, 0]
    np.testing.assert_allclose(effects[:, 1], np.maximum(effects[:, 0], 0.01), rtol=0.02)


def test_what_is_joined_are_equations_of_a_pose():
    one = Estimate.of([residuals(1)], 1.0, NO_BIAS)
    with pytest.raises(ValueError, match='the bias has 6 numbers: 36 are required'):
        joint_estimate(one, one, np.eye(4), np.ones(6))
    with pytest.raises(ValueError, match='the pose has 9 numbers: 16 are required'):
        joint_estimate(one, one, np.eye(3), NO_BIAS)
