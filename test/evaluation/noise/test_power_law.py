# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Power laws recovered from exact points, noisy points and outliers."""

import numpy as np
import pytest

from aick_ros.evaluation.noise.power_law import fit_exponent, fit_scale

X = np.geomspace(0.5, 5.0, 12)
EVEN = np.ones(len(X))


@pytest.mark.parametrize('exponent', [0.0, 1.0, 2.0, 2.5])
def test_points_on_a_law(exponent):
    y = 0.0015 * X ** exponent
    assert fit_exponent(X, y, EVEN) == pytest.approx(exponent, abs=1e-9)
    assert fit_scale(X, y, EVEN, exponent) == pytest.approx(0.0015)


def test_outliers_do_not_bend_it():
    y = 0.0015 * X ** 2
    y[[0, 5]] *= 4
    assert fit_exponent(X, y, EVEN) == pytest.approx(2.0, abs=0.01)
    assert fit_scale(X, y, EVEN, 2.0) == pytest.approx(0.0015, rel=0.01)


def test_weights_are_followed_as_numpy_does():
    rng = np.random.default_rng(0)
    y = 0.002 * X ** 1.7 * np.exp(rng.uniform(-0.01, 0.01, len(X)))
    weights = rng.uniform(1.0, 5.0, len(X))
    expected = np.polyfit(np.log(X), np.log(y), 1, w=np.sqrt(weights))[0]
    assert fit_exponent(X, y, weights) == pytest.approx(expected, abs=2e-3)
