# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is drawn of NEES."""

import numpy as np
import pytest
from scipy import stats

from aick_ros.reports.consistency_plot import nees_figure


def bars(figure):
    """Return the heights of the bars: 24 of the axis and the one of what is beyond."""
    return [bar.get_height() for bar in figure.axes[0].patches]


def test_bars_and_curve_agree_for_correct_covariances():
    values = stats.chi2(6).ppf((np.arange(5000) + 0.5) / 5000)
    figure = nees_figure(values, 'office')
    expected = 100 * np.diff(stats.chi2(6).cdf(np.arange(25)))
    np.testing.assert_allclose(bars(figure)[:-1], expected, atol=0.05)
    curve = next(line for line in figure.axes[0].lines if line.get_label().startswith('correct'))
    np.testing.assert_allclose(curve.get_ydata(), 100 * stats.chi2(6).pdf(curve.get_xdata()))
    assert 'mean 6.0' in figure.axes[0].get_xlabel()
    assert '95.0 %' in figure.axes[0].get_xlabel()


@pytest.mark.parametrize('values, beyond', [
    ([np.inf], 100), ([0.0], 0), ([3, 24.5, 1e6], 200 / 3)])
def test_nothing_falls_off_the_axis(values, beyond):
    heights = bars(nees_figure(values, 'office'))
    assert sum(heights) == pytest.approx(100)
    assert heights[-1] == pytest.approx(beyond)
