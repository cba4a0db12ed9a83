# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The densities of sensors whose noise is known, with intervals that hold."""

import numpy as np
import pytest

from aick_ros.evaluation.noise.allan_fit import fit_densities
from aick_ros.evaluation.noise.allan_variance import AllanVariance, allan_variance


def simulated(noise, walk, duration, seed, interval=0.1):
    """Return values of a sensor at rest."""
    rng = np.random.default_rng(seed)
    shape = round(duration / interval), 3
    bias = np.cumsum(walk * np.sqrt(interval) * rng.normal(size=shape), axis=0)
    return bias + noise / np.sqrt(interval) * rng.normal(size=shape)


def estimates(noise, walk, duration, interval=0.1):
    return [fit_densities(allan_variance(simulated(noise, walk, duration, seed, interval),
                                         interval)) for seed in range(40)]


def inside(found, truth):
    """Return the number of intervals that have the truth inside."""
    return sum(estimate.low <= truth <= estimate.high for estimate in found)


def test_a_curve_of_the_model_gives_its_densities():
    times = 0.1 * 2.0 ** np.arange(12)
    variances = (0.02 ** 2 / times + 0.003 ** 2 * times / 3)[:, None]
    found = fit_densities(AllanVariance(times, variances, 10000 / times))
    assert found.noise.value == pytest.approx(0.02)
    assert found.bias_walk.value == pytest.approx(0.003)
    np.testing.assert_allclose(found.at(times), variances[:, 0])


def test_what_a_filter_in_the_sensor_smooths_is_not_used():
    times = 0.0125 * 2.0 ** np.arange(14)
    variances = (0.02 ** 2 / times + 0.003 ** 2 * times / 3)[:, None]
    variances[times < 0.1] *= 0.2
    found = fit_densities(AllanVariance(times, variances, 10000 / times))
    assert found.noise.value == pytest.approx(0.02)


@pytest.mark.parametrize('noise, walk, duration, interval', [
    (1.0, 0.1, 600.0, 0.1), (2e-4, 2e-6, 7200.0, 1.0)])
def test_intervals_of_95_percent_have_the_truth_inside(noise, walk, duration, interval):
    """Of 40, the 33 required are fewer once in 2000."""
    found = estimates(noise, walk, duration, interval)
    assert 33 <= inside([densities.noise for densities in found], noise)
    assert 33 <= inside([densities.bias_walk for densities in found], walk)
    ratios = [densities.noise.value / noise for densities in found]
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.01)
    sizes = [densities.noise.high / densities.noise.low for densities in found]
    assert np.mean(sizes) < 1.1  # of no use where they are wide
    # 3.92 standard deviations, of which 40 values show one within 23 % in 19 of 20 cases
    assert np.log(sizes).mean() / 3.92 == pytest.approx(np.log(ratios).std(), rel=0.4)


def test_a_walk_that_does_not_show_is_not_invented():
    found = estimates(1.0, 0.001, 100.0)
    assert [densities.bias_walk.value for densities in found] == [None] * 40
    assert all(0.001 < densities.bias_walk.high < 0.3 for densities in found)
    assert 33 <= inside([densities.noise for densities in found], 1.0)


def test_a_walk_alone_is_one():
    found = fit_densities(allan_variance(simulated(1e-9, 1.0, 600.0, seed=0), 0.1))
    assert found.bias_walk.value == pytest.approx(1.0, rel=0.1)
    assert found.noise.value is None or found.noise.value < 0.1
