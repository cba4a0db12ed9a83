# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The curves that are drawn, and what a reader finds on the axes."""

import cv2
import pytest

from aick_ros.evaluation.baselines.registry import METHODS
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
    """Return a function that draws figures and returns them with the files."""
    def draw(figures, recordings):
        kept = []
        write = benchmark_plots.canvas.write_png
        monkeypatch.setattr(benchmark_plots.canvas, 'write_png',
                            lambda figure, path: (kept.append(figure), write(figure, path)))
        return kept, write_figures(figures, recordings, tmp_path)
    return draw


def test_each_recording_has_a_panel_with_its_own_time(drawn):
    (figure,), (path,) = drawn(FIGURES, RECORDINGS)
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
