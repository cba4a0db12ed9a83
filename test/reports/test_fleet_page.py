# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The page of a fleet against means and shares counted by hand."""

import re

import numpy as np
import pytest

pytest.importorskip('matplotlib')
from aick_ros.reports import fleet_page as module  # noqa: E402
from aick_ros.reports.fleet_page import fleet_page  # noqa: E402

RPE, ATE = 'trajectory.rpe_1s_translation_rmse_m', 'trajectory.ate_rmse_m'


def done(source, variant, rpe, **others):
    return {'status': 'done', 'source': source, 'recording': source, 'variant': variant,
            'frames': 100, 'duration_s': 1800.0, RPE: rpe, **others}


def failed(source, variant, **others):
    return {'status': 'failed', 'source': source, 'variant': variant, 'cause': 'input',
            'reason': 'no <images>', 'attempts': 2, **others}


ROWS = [done('a', 'fast', 0.010, **{ATE: 0.5}), done('b', 'fast', 0.030, **{ATE: None}),
        done('a', 'slow', 0.005), failed('b', 'slow'), failed('c', 'other')]


def tables(page):
    """Return the tables of a page, each a list of rows of text."""
    return [[re.findall(r'<t[dh][^>]*>(.*?)</t[dh]>', row)
             for row in re.findall(r'<tr>(.*?)</tr>', table)]
            for table in re.findall(r'<table.*?</table>', page, re.DOTALL)]


@pytest.mark.usefixtures('undrawn')
def test_tiles_count_runs_and_different_recordings():
    page = fleet_page(ROWS)
    tiles = dict((label, value) for value, label in re.findall(
        r'<b>(.*?)</b><span>(.*?)</span>', page))
    assert tiles == {'runs': '5', 'recordings': '3', 'failed': '2', 'frames': '300',
                     'hours recorded': '1.50'}


@pytest.mark.usefixtures('undrawn')
def test_settings_have_means_over_their_own_runs():
    settings = tables(fleet_page(ROWS))[0]
    columns = dict(zip(settings[0], zip(*settings[1:])))
    assert columns['settings'] == ('fast', 'slow', 'other')
    assert (columns['done'], columns['failed']) == (('2', '1', '0'), ('0', '1', '1'))
    assert columns['RPE over 1 s [mm]'] == ('20.00', '5.00', '')
    assert columns['ATE [mm]'] == ('500.0', '', '')


@pytest.mark.parametrize('column, value, head, text', [
    ('trajectory.rpe_1s_translation_rmse_m', 0.012345, 'RPE over 1 s [mm]', '12.35'),
    ('trajectory.rpe_1s_rotation_rmse_deg', 0.45678, 'RPE over 1 s [deg]', '0.457'),
    ('trajectory.ate_rmse_m', 0.12345, 'ATE [mm]', '123.5'),
    ('trajectory.tracked_fraction', 0.98765, 'tracked [%]', '98.8'),
    ('consistency.inside_95', 0.91234, 'inside 95 % [%]', '91.2'),
    ('timing_ms.total.p50', 23.456, 'median time [ms]', '23.5'),
    ('peak_memory_mb', 345.6, 'peak memory [MB]', '346')])
@pytest.mark.usefixtures('undrawn')
def test_scores_are_in_the_unit_of_their_head(column, value, head, text):
    for table in tables(fleet_page([done('a', 'fast', 1.0, **{column: value})])):
        assert dict(zip(table[0], table[1]))[head] == text


def test_tables_are_in_sections_and_can_be_sorted():
    page = fleet_page(ROWS)
    assert re.findall(r'<h(\d)>(.*?)</h', page) == [
        ('1', 'Runs of a fleet'), ('2', 'Settings'), ('2', 'Errors of all recordings'),
        ('2', 'Runs'), ('2', 'Failures')]
    assert '<title>Runs of a fleet</title>' in page and '<script>' in page
    assert page.count('<table class="sortable">') == 3 == len(tables(page))
    assert [table[0][:3] for table in tables(page)] == [
        ['settings', 'done', 'failed'], ['recording', 'settings', 'frames'],
        ['source', 'settings', 'cause']]


@pytest.mark.usefixtures('undrawn')
def test_each_run_and_each_failure_has_a_row():
    _, runs, failures = tables(fleet_page(ROWS))
    assert [row[:4] for row in runs[1:]] == [
        ['a', 'fast', '100', '10.00'], ['b', 'fast', '100', '30.00'],
        ['a', 'slow', '100', '5.00']]
    assert failures == [['source', 'settings', 'cause', 'reason', 'attempts'],
                        ['b', 'slow', 'input', 'no &lt;images&gt;', '2'],
                        ['c', 'other', 'input', 'no &lt;images&gt;', '2']]


@pytest.mark.usefixtures('undrawn')
def test_each_run_has_the_number_of_frames_with_ground_truth():
    rows = [done('a', 'fast', 0.01, **{'trajectory.covered_frames': 6}), done('b', 'fast', 0.01)]
    runs = tables(fleet_page(rows))[1]
    assert [row[-1] for row in runs] == ['frames with ground truth', '6', '']


@pytest.mark.parametrize('count, more', [(200, None), (201, '1 more'), (250, '50 more')])
def test_of_many_failures_the_first_are_listed_and_the_others_counted(count, more):
    page = fleet_page([failed(str(i), 'fast') for i in range(count)])
    assert [row[0] for row in tables(page)[-1][1:]] == [str(i) for i in range(min(count, 200))]
    found = re.search(r'(\d+ more) are in the table', page)
    assert (found and found[1]) == more


@pytest.mark.usefixtures('undrawn')
def test_sensors_that_are_not_used_are_named():
    page = fleet_page([done('a', 'fast', 0.01, unused_sensors=''),
                       done('b', 'fast', 0.01, unused_sensors='it <hangs>')])
    assert '<h2>Sensors that are not used</h2>' in page
    assert tables(page)[-1] == [['source', 'settings', 'reason'],
                                ['b', 'fast', 'it &lt;hangs&gt;']]
    assert 'Sensors' not in fleet_page(ROWS)


@pytest.mark.usefixtures('undrawn')
def test_remarks_on_recordings_are_listed():
    page = fleet_page([done('a', 'fast', 0.01, remarks=''),
                       done('b', 'fast', 0.01, remarks='<2> images skipped')])
    assert '<h2>Remarks on recordings</h2>' in page
    assert tables(page)[-1] == [['source', 'settings', 'remarks'],
                                ['b', 'fast', '&lt;2&gt; images skipped']]
    assert 'Remarks' not in fleet_page(ROWS)


def test_without_errors_or_failures_there_are_no_pictures_or_failures():
    page = fleet_page([done('a', 'fast', None)])
    assert '<svg' not in page and 'Failures' not in page
    assert 'Errors of all recordings' not in page


@pytest.fixture
def drawn(monkeypatch):
    """Return a function that makes the page of some runs and returns its figure."""
    figures, make = [], module.canvas.figure
    monkeypatch.setattr(module.canvas, 'figure', lambda *arguments: figures.append(
        make(*arguments)) or figures[-1])

    def draw(rows):
        fleet_page(rows)
        return figures[-1]
    return draw


def test_curves_rise_by_a_share_at_each_error(drawn):
    """From the smallest error on; in the unit of the axis."""
    axes, other = drawn(ROWS).axes
    assert axes.get_xscale() == 'log'
    assert (axes.get_ylabel(), axes.get_ylim()) == ('recordings [%]', (0, 100))
    assert (axes.get_xlabel(), other.get_xlabel()) == ('RPE over 1 s [mm]', 'ATE [mm]')
    fast, slow, nothing = (line.get_data() for line in axes.lines)
    np.testing.assert_allclose(fast, [[10, 10, 30], [0, 50, 100]])
    np.testing.assert_allclose(slow, [[5, 5], [0, 100]])
    assert len({line.get_color() for line in axes.lines}) == 3


@pytest.mark.parametrize('count, has_legend', [(1, False), (2, True), (10, True), (11, False)])
@pytest.mark.usefixtures('undrawn')
def test_a_legend_has_the_beginnings_of_the_settings(drawn, count, has_legend):
    names = [f'{i}' + 60 * 'x' for i in range(count)]
    figure = drawn([done('a', name, 0.01 * (i + 1)) for i, name in enumerate(names)])
    texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert texts == [name[:40] for name in names] * has_legend


def test_an_error_of_zero_is_drawn_on_a_logarithmic_axis(drawn):
    line, = drawn([done('a', 'fast', 0.0), done('b', 'fast', 0.01)]).axes[0].lines
    np.testing.assert_allclose(line.get_xdata(), [1e-6, 1e-6, 10.0])


@pytest.mark.parametrize('errors', [(6.7, 12.6), (0.78, 1.89), (8.0,), (5.1, 19.9), (3.0, 28.0),
                                    (1.0, 900.0)])
@pytest.mark.usefixtures('undrawn')
def test_an_axis_of_any_width_has_numbers_to_read_it_by(drawn, errors):
    figure = drawn([done(str(i), 'fast', error / 1e3) for i, error in enumerate(errors)])
    figure.draw_without_rendering()
    axes = figure.axes[0]
    low, high = axes.get_xlim()
    shown = {label.get_text() for label in axes.get_xticklabels()
             if low <= label.get_position()[0] <= high}
    assert 2 <= len(shown) <= 12
