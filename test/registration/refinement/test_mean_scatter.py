# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The mean shape of scatter, on scatter of a few samples that is drawn."""

import numpy as np
import pytest

from aick_ros.registration.refinement.mean_scatter import MeanScatter


def drawn(rng, covariance, samples=30):
    """Return the scatter of some samples."""
    values = rng.multivariate_normal(np.zeros(6), covariance, samples)
    return values.T @ values / samples


def test_the_mean_shape_is_that_of_the_covariance_whatever_the_scale():
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6))
    covariance, mean = root @ root.T, MeanScatter()
    np.testing.assert_array_equal(mean.shape, np.eye(6))
    for _ in range(300):
        mean = mean.with_sample(rng.lognormal(0.0, 2.0) * drawn(rng, covariance))
    assert np.trace(mean.shape) == pytest.approx(6.0)
    np.testing.assert_allclose(mean.shape, covariance * 6 / np.trace(covariance), atol=0.2)


def test_one_registration_says_little():
    """It counts as one beside the five of the prior."""
    scatter = np.diag([6.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(np.diag(MeanScatter().with_sample(7.0 * scatter).shape),
                               [11 / 6, *5 * [5 / 6]])


def test_a_mean_of_few_directions_is_right_about_those_that_scatter_little_by_chance():
    """Their mean is nearer than one scatter, in each of its directions."""
    rng, mean = np.random.default_rng(2), MeanScatter()
    for _ in range(100):
        mean = mean.with_sample(drawn(rng, np.eye(6), 12))
    assert np.linalg.eigvalsh(drawn(rng, np.eye(6), 12)).min() < 0.5
    assert np.linalg.eigvalsh(mean.shape).min() > 0.8


@pytest.mark.parametrize('scatter', [np.zeros((6, 6)), np.full((6, 6), np.nan),
                                     np.full((6, 6), np.inf)])
def test_without_scatter_nothing_changes(scatter):
    mean = MeanScatter().with_sample(np.eye(6))
    assert mean.with_sample(scatter) is mean
