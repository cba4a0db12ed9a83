# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The median against that of the standard library."""

import statistics

import numpy as np
import pytest

from aick_ros.geometry.median import median


@pytest.mark.parametrize('count', [1, 2, 3, 4, 99, 100])
def test_median_is_that_of_the_standard_library(count):
    rng = np.random.default_rng(count)
    for _ in range(20):
        values = rng.normal(size=count).round(1)
        before = values.copy()
        assert median(values) == pytest.approx(statistics.median(values.tolist()), abs=1e-15)
        np.testing.assert_array_equal(values, before)
