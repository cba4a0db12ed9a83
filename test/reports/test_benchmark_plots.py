# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The curves that are drawn, and what a reader finds on the axes."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from aick_ros.evaluation.baselines.registry import METHODS
from aick_ros.evaluation.benchmark.figures import paper_figures
from aick_ros.reports import benchmark_plots
from aick_ros.reports.benchmark_plots import write_figures

RECORDINGS = {'room': {'period_ms': 33.0}, 'hall': {'period_ms': 40.0}}
CURVES = {
    'aick-orb': {'label': 'AICK ORB', 'recordings': {
        'room': {'x': [1, 5], 'success_ratio': [0.9, 0.4]},
        'hall': {'x': [1, 5], 'success_ratio': [0.8, 0.3]}}},
    'pnp': {'label': 'PnP RANSAC', 'recordings': {
        'room': {'x': [1, 5], 'success_ratio': [0.7, 0.2]}}}}
FIGURES = {'4': {'title': 'Farther apart', 'axis': 'gap', 'curves': CURVES}}


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """Return a function that draws figures and returns them with the files, written if asked."""
    write = benchmark_plots.canvas.write_png

    def draw(figures, recordings, is_written=False):
        kept = []
        monkeypatch.setattr(benchmark_plots.canvas, 'write_png',
                            lambda figure, path: (kept.append(figure),
                                                  is_written and write(figure, path)))
        return kept, write_figures(figures, recordings, tmp_path)
    return draw


def test_each_recording_has_a_panel_with_its_own_time(drawn):
    (figure,), (path,) = drawn(FIGURES, RECORDINGS, is_written=True)
    room, hall = figure.axes
    assert [axes.get_title(loc='left') for axes in (room, hall)] == ['room', 'hall']
    assert room.get_xlabel() == 'time between the frames [ms]'
    assert [list(line.get_xdata()) for line in room.lines] == [[33.0, 165.0]] * 2
    assert [list(line.get_ydata()) for line in room.lines] == [[0.9, 0.4], [0.7, 0.2]]
    assert [list(line.get_xdata()) for line in hall.lines] == [[40.0, 200.0]]
    assert path.name == 'figure-4.png'
    assert min(cv2.imread(str(path)).shape[:2]) > 500


def test_a_threshold_is_in_millimetres_and_the_papers_is_marked(drawn):
    curve = {'label': 'AICK', 'recordings': {'room': {'x': [0.0, 0.05],
                                                      'success_ratio': [0, 1]}}}
    (figure,), _ = drawn({'3': {'title': 'Near', 'axis': 'threshold_m',
                                'curves': {'aick': curve}}}, {'room': RECORDINGS['room']})
    line, mark = figure.axes[0].lines
    assert list(line.get_xdata()) == [0.0, 50.0]
    assert list(mark.get_xdata()) == [10.0, 10.0]
    assert '[mm]' in figure.axes[0].get_xlabel()


def test_a_method_has_one_colour_of_its_own(drawn):
    (first, second), _ = drawn({**FIGURES, '9': {**FIGURES['4'], 'curves': dict(
        reversed(CURVES.items()))}}, RECORDINGS)
    colours = [{line.get_label(): line.get_color() for line in figure.axes[0].lines}
               for figure in (first, second)]
    assert colours[0] == colours[1]
    assert set(METHODS) <= set(benchmark_plots._COLOURS)
    assert len(set(benchmark_plots._COLOURS.values())) == len(benchmark_plots._COLOURS)


@pytest.mark.parametrize('count, rows, columns', [(1, 1, 1), (2, 1, 2), (3, 2, 2), (5, 3, 2)])
def test_panels_are_two_in_a_row_and_what_is_left_is_empty(drawn, count, rows, columns):
    recordings = {f'hall {i}': {'period_ms': 33.0} for i in range(count)}
    curve = {'label': 'AICK', 'recordings': {name: {'x': [1], 'success_ratio': [1.0]}
                                             for name in recordings}}
    (figure,), _ = drawn({'4': {'title': 'Apart', 'axis': 'gap', 'curves': {'aick': curve}}},
                         recordings)
    assert len(figure.axes) == rows * columns
    shown, empty = figure.axes[:count], figure.axes[count:]
    assert [axes.get_title(loc='left') for axes in shown] == list(recordings)
    assert all(axes.axison for axes in shown) and not any(axes.axison for axes in empty)
    assert [axes.get_ylabel() for axes in shown] == [
        'success ratio' if i % columns == 0 else '' for i in range(count)]
    assert {axes.get_ylim() for axes in shown} == {(-0.02, 1.02)}
    assert {axes.get_xlim()[0] for axes in shown} == {0.0}
    np.testing.assert_allclose(figure.get_size_inches(), (
        max(5.0 * columns, 6.5), 0.7 + 3.9 * rows))
    [legend] = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ['AICK']


@pytest.mark.parametrize('axis, title', [
    ('gap', 'Near; success within 10 mm'), ('threshold_m', 'Near')])
def test_the_title_names_the_threshold_where_it_is_no_axis(drawn, axis, title):
    (figure,), _ = drawn({'3': {'title': 'Near', 'axis': axis, 'curves': CURVES}}, RECORDINGS)
    assert figure.get_suptitle() == title
    markers = {line.get_marker() for axes in figure.axes for line in axes.lines}
    assert (markers <= {'', 'None'}) is (axis == 'threshold_m')
    marks = [line for axes in figure.axes for line in axes.lines if line.get_linestyle() == '--']
    assert len(marks) == (2 if axis == 'threshold_m' else 0)


@pytest.mark.parametrize('count', [1, 2])
@pytest.mark.parametrize('name', [figure.title for figure in paper_figures(Path('v'))])
def test_a_title_fits_into_the_figure(count, name):
    recordings = dict(list(RECORDINGS.items())[:count])
    figure = benchmark_plots._figure({'title': name, 'axis': 'gap', 'curves': CURVES}, recordings)
    box = figure._suptitle.get_window_extent()
    assert figure.bbox.x0 <= box.x0 and box.x1 <= figure.bbox.x1
    assert figure.get_suptitle() == f'{name};{" " if count == 2 else chr(10)}success within 10 mm'


def test_settings_that_are_varied_have_colours_from_dark_to_light(drawn):
    curves = {str(words): {'label': str(words), 'recordings': {
        'room': {'x': [1, 2], 'success_ratio': [0.5, 0.4]}}} for words in (10, 100, 1000)}
    (figure,), _ = drawn({'9': {'title': 'Words', 'axis': 'gap', 'curves': curves}},
                         {'room': {'period_ms': 33.0}})
    lines = figure.axes[0].lines
    assert [line.get_label() for line in lines] == ['10', '100', '1000']
    lightness = [np.dot(to_rgb(line.get_color()), (0.2, 0.7, 0.1)) for line in lines]
    assert lightness[0] > lightness[1] > lightness[2]
    assert len({line.get_marker() for line in lines}) == 3


def test_a_curve_without_points_is_a_name_in_the_legend(drawn):
    """Of a recording without consecutive frames there is none over the threshold."""
    curve = {'label': 'AICK', 'recordings': {'room': {'x': [], 'success_ratio': []}}}
    (figure,), _ = drawn({'3': {'title': 'Near', 'axis': 'threshold_m',
                                'curves': {'aick': curve}}}, {'room': RECORDINGS['room']},
                         is_written=True)
    assert len(figure.axes[0].lines[0].get_xdata()) == 0
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ['AICK']
