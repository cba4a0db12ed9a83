# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is drawn of NEES."""

import numpy as np
import pytest
from matplotlib.colors import to_hex
from scipy import stats

from aick_ros.reports import canvas
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


def test_quantiles_ticks_and_the_share_beyond_are_named():
    figure = nees_figure([3.0, 24.5, 30.0], 'office: odometry')
    axes, = figure.axes
    inner, outer = stats.chi2(6).ppf([0.95, 0.997])
    marks = {line.get_xdata()[0]: line for line in axes.lines if line.get_linestyle() == '--'}
    np.testing.assert_allclose(list(marks), [inner, outer])
    assert {text.get_text(): text.xy[0] for text in axes.texts} == {
        '66.7 %': 25.5, '95 %': pytest.approx(inner), '99.7 %': pytest.approx(outer)}
    assert [label.get_text() for label in axes.get_xticklabels()] == [
        '0', '6', '12', '18', '24', 'beyond']
    np.testing.assert_allclose(axes.get_xticks(), [0, 6, 12, 18, 24, 25.5])
    assert axes.get_xlim() == (0.0, 26.5)
    centres = [bar.get_x() + bar.get_width() / 2 for bar in axes.patches]
    np.testing.assert_allclose(centres, [*np.arange(0.5, 24), 25.5])
    assert to_hex(axes.patches[0].get_facecolor()) == canvas.ESTIMATE
    assert to_hex(axes.patches[-1].get_facecolor()) == canvas.LOST


def test_texts_say_what_is_drawn():
    axes, = nees_figure([1.0, 2.0, 30.0, np.inf], 'office: odometry').axes
    assert (axes.get_title(loc='left'), axes.get_ylabel()) == (
        'office: odometry', '% of the increments')
    assert axes.get_xlabel() == (
        'NEES, 6 degrees of freedom\n4 increments, mean 11.0 (correct: 6), inside the 95 % '
        'ellipsoid 50.0 %')
    of_pairs, = nees_figure([1.0, 2.0], 'office: pairs', 'pairs').axes
    assert of_pairs.get_ylabel() == '% of the pairs'
    assert '\n2 pairs, mean 1.5' in of_pairs.get_xlabel()
    assert 'mean - (' in nees_figure([np.inf], 'x').axes[0].get_xlabel()
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [
        'correct covariances', 'measured']
