# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The page of a comparison: whole, and harmless whatever names are in it."""

import re

import numpy as np
import pytest

from aick_ros.evaluation.comparison.comparison import Change, Comparison, Verdict
from aick_ros.evaluation.comparison.frame_counts import FrameCounts
from aick_ros.evaluation.comparison.metrics import ATE, LOST
from aick_ros.reports import canvas
from aick_ros.reports import comparison_page as comparison_module
from aick_ros.reports.comparison_page import comparison_page

NAME = '<img src=x onerror="alert(1)"> $x$'


@pytest.fixture(scope='module')
def text():
    worse = Change(0.01, 0.012, 0.2, 0.1, 0.3, Verdict.WORSE)
    same = Change(0.0, 0.0, 0.0, 0.0, 0.0, Verdict.CHANCE)
    changes = {ATE: worse, LOST: same}
    return comparison_page('a & b', {NAME: Comparison(
        {NAME: changes, 'other': changes}, changes, ['first'], ['second'],
        {'aick.alpha': (0.7, NAME)})})


def test_names_are_text(text):
    assert '<img' not in text
    assert 'a &amp; b' in text
    assert text.count('&lt;img src=x') >= 4


def test_changes_have_units_and_missing_runs_are_named(text):
    assert '<td>0.01 m</td><td>0.012 m</td><td>+20.0 %</td><td>+10.0 % to +30.0 %</td>' in text
    assert '<td>+0.0 pp</td>' in text
    assert 'The candidate has no run of first' in text
    assert 'The baseline has no run of second' in text
    assert text.count('<svg') == 2


def test_nothing_is_fetched(text):
    inside = re.sub(r'xmlns(:\w+)?="[^"]*"|<metadata>.*?</metadata>', '', text, flags=re.DOTALL)
    assert not re.search(r'(src|href)="(?!#)|url\((?!#)|@import', inside)


def test_one_recording_is_named_and_has_no_pictures_of_many():
    change = Change(0.01, 0.012, 0.2, 0.1, 0.3, Verdict.WORSE)
    text = comparison_page('a', {'b': Comparison({'desk': {ATE: change}}, {ATE: change}, [], [],
                                                 {'aick.alpha': (0.7, 0.8)})})
    assert 'Recording: desk' in text and '<svg' not in text
    assert '<td>aick.alpha</td><td>0.7</td><td>0.8</td>' in text
    assert 'not compared' not in text


def test_frames_of_one_run_alone_are_named():
    same = Change(1.0, 1.0, 0.0, 0.0, 0.0, Verdict.CHANCE)
    text = comparison_page('a', {'b': Comparison(
        {'desk': {ATE: same}}, {ATE: same}, [], [], {}, {'desk': FrameCounts(144, 99, 97)})})
    assert ('The candidate lacks frames that the baseline has, 47 of 144 of desk: only frames of '
            'both are compared.') in text
    assert 'The baseline lacks frames that the candidate has, 2 of 99 of desk' in text


def test_heads_are_above_what_they_name(text):
    heads = re.findall(r'<th>(.*?)</th>', text)
    assert heads[:6] == ['metric', 'baseline', 'candidate', 'change', '99% interval', 'verdict']
    assert heads[6:9] == ['setting', 'baseline', 'candidate']
    assert heads[9:15] == ['recording', *heads[1:6]]
    assert re.findall(r'<td>(worse|within chance|better|not tested)</td>', text)[:2] == [
        'worse', 'within chance']
    assert [head for _, head in re.findall(r'<h(\d)>(.*?)</h', text)] == [
        'Comparison of runs', '&lt;img src=x onerror=&quot;alert(1)&quot;&gt; $x$',
        'Settings that differ', 'ATE', 'Frames not tracked']
    assert 'Baseline: a &amp; b' in text and '2 recordings' in text
    assert 'a bootstrap over blocks of 2 s' in text
    assert text.count('<table class="sortable">') == 2  # those with a row for each recording


def test_without_other_settings_there_are_none():
    same = Change(1.0, 1.0, 0.0, 0.0, 0.0, Verdict.CHANCE)
    text = comparison_page('a', {'b': Comparison({'desk': {ATE: same}}, {ATE: same}, [], [], {})})
    assert '<p class="quiet">None.</p>' in text and '<th>setting</th>' not in text


@pytest.mark.parametrize('metric, value, change, texts', [
    (ATE, 0.0123456, 0.1234, ('0.01235 m', '+12.3 %')), (LOST, 0.5, -0.05, ('0.5', '-5.0 pp'))])
def test_values_have_units_and_changes_signs(metric, value, change, texts):
    assert (comparison_module.value_text(metric, value),
            comparison_module.change_text(metric, change)) == texts


@pytest.fixture
def figures(monkeypatch):
    """Return the list of the figures that are drawn."""
    drawn, make = [], comparison_module.canvas.figure
    monkeypatch.setattr(comparison_module.canvas, 'figure', lambda *arguments: drawn.append(
        make(*arguments)) or drawn[-1])
    return drawn


def test_bars_are_in_percent_the_first_recording_on_top(figures):
    better = Change(0.02, 0.01, -0.5, -0.6, -0.4, Verdict.BETTER)
    worse = Change(0.01, 0.012, 0.2, 0.1, 0.3, Verdict.WORSE)
    comparison_page('a', {'b': Comparison({'desk': {ATE: better}, 'hall': {ATE: worse}},
                                          {ATE: better}, [], [], {})})
    axes, = figures[0].axes
    bars = [line.get_data() for line in axes.lines]
    np.testing.assert_allclose(bars[0], [[-60, -40], [1, 1]])
    np.testing.assert_allclose(np.ravel(bars[1]), [-50, 1])
    np.testing.assert_allclose(bars[2], [[10, 30], [0, 0]])
    assert [label.get_text() for label in axes.get_yticklabels()] == ['desk', 'hall']
    assert axes.lines[0].get_color() != axes.lines[2].get_color()
    assert axes.get_xlabel() == 'change [%], better to the left'


def test_bars_have_the_colour_of_their_verdict_and_shares_change_by_points(figures):
    changes = {verdict.value: {LOST: Change(0.1, 0.2, 0.1, 0.0, 0.2, verdict)}
               for verdict in Verdict}
    comparison_page('a', {'b': Comparison(changes, {LOST: changes['worse'][LOST]}, [], [], {})})
    axes, = figures[0].axes
    colours = {verdict.value: axes.lines[2 * i].get_color() for i, verdict in enumerate(Verdict)}
    assert colours == {'worse': canvas.LOST, 'better': canvas.SERIES[2],
                       'within chance': canvas.MUTED, 'not tested': canvas.MUTED}
    assert [axes.lines[2 * i + 1].get_color() for i in range(4)] == list(colours.values())
    assert axes.get_xlabel() == 'change [percentage points], better to the left'
    assert axes.lines[-1].get_xdata()[0] == 0


def test_a_metric_has_a_row_for_each_recording_that_has_it(figures):
    """Its picture grows by the recordings."""
    change = Change(0.01, 0.012, 0.2, 0.1, 0.3, Verdict.WORSE)
    names = [f'recording {i}' for i in range(5)]
    recordings = {name: {ATE: change, **({LOST: change} if i < 2 else {})}
                  for i, name in enumerate(names)}
    text = comparison_page('a', {'b': Comparison(recordings, {ATE: change, LOST: change}, [], [],
                                                 {})})
    rows = [re.findall('<tr><td>(recording .)', table) for table in text.split('<table')[2:]]
    assert rows == [names, names[:2]]
    assert [[label.get_text() for label in figure.axes[0].get_yticklabels()]
            for figure in figures] == [names, names[:2]]
    heights = [figure.get_size_inches()[1] for figure in figures]
    assert heights[0] - heights[1] == pytest.approx(3 * 0.3)
