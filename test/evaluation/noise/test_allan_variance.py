# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The Allan variance, against its definition and the laws of white noise and random walks."""

import numpy as np
import pytest

from aick_ros.evaluation.noise.allan_variance import allan_variance


def by_definition(values, length):
    """Return half the mean squared difference of neighbouring means, from each start on."""
    means = [values[start:start + length].mean()
             for start in range(len(values) - length + 1)]
    differences = np.array(means[length:]) - np.array(means[:-length])
    return 0.5 * np.mean(differences ** 2)


@pytest.mark.parametrize('count', [5, 9, 10, 203])
def test_it_is_that_of_the_definition(count):
    rng = np.random.default_rng(count)
    values = np.column_stack([rng.normal(3.0, 1.0, count), np.cumsum(rng.normal(size=count))])
    found = allan_variance(values, 0.01)
    assert len(found.times) == len(found.degrees_of_freedom) == len(found.variances)
    for time, variances in zip(found.times, found.variances):
        expected = [by_definition(values[:, axis], round(time / 0.01)) for axis in range(2)]
        np.testing.assert_allclose(variances, expected, rtol=1e-9)


def test_times_double_as_long_as_there_are_five_means():
    assert allan_variance(np.zeros((159, 1)), 0.5).times.tolist() == [0.5, 1, 2, 4, 8]
    assert allan_variance(np.zeros((160, 1)), 0.5).times.tolist() == [0.5, 1, 2, 4, 8, 16]


@pytest.mark.parametrize('walks', [False, True])
def test_its_error_has_at_least_the_degrees_of_freedom(walks):
    """400 simulated sensors: the variance of a chi-square distributed error is 2 / dof."""
    values = np.random.default_rng(0).normal(size=(2000, 400))
    values = np.cumsum(values, axis=0) if walks else values
    found = allan_variance(values, 1.0)
    lengths = found.times
    expected = (2 * lengths ** 2 + 1) / (6 * lengths) if walks else 1 / lengths
    relative = found.variances / expected[:, None]
    np.testing.assert_allclose(relative.mean(axis=1), 1.0, atol=0.12)
    scatter = relative.std(axis=1) / found.relative_errors
    assert scatter.max() < 1.15
    assert scatter.min() > 0.7


def test_a_large_bias_costs_no_digits():
    values = np.random.default_rng(1).normal(size=(4000, 1))
    np.testing.assert_allclose(allan_variance(values + 1e6, 1.0).variances,
                               allan_variance(values, 1.0).variances, rtol=1e-6)
