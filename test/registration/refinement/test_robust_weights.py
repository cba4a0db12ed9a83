# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Constants of the robust weights against the distributions that they come from."""

import numpy as np
import pytest
from scipy.stats import chi2

from aick_ros.registration.refinement import robust_weights


def test_medians_are_those_of_squares_with_one_and_two_degrees_of_freedom():
    assert robust_weights.MEDIAN_1 == pytest.approx(chi2.median(1))
    assert robust_weights.MEDIAN_2 == pytest.approx(chi2.median(2))


def test_kernels_take_what_grows_with_the_width_and_what_does_not():
    """Three widths from the pose a track is another motion's; scales are squared."""
    np.testing.assert_array_equal(robust_weights.robustness(2.0, 0.5), [2.0, 0.5, 16.0])
    np.testing.assert_array_equal(robust_weights.truncation(2.0), [6.0, 0.0625])
