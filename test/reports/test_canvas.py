# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names of recordings in figures."""

import warnings
from xml.etree import ElementTree

import cv2
import matplotlib
import pytest
from matplotlib.text import Text

from aick_ros.reports import canvas


@pytest.mark.parametrize('name, shown', [
    ('a\x1b[31m\u202eb', r'a\x1b[31m\u202eb'), ('$x_{$', '$x_{$'),
    ('\u5eca\u4e0b', '\u5eca\u4e0b'), ('\udcff', r'\xff')])
def test_any_name_is_drawn_without_a_warning(name, shown, tmp_path):
    """Also characters that the font does not have."""
    def draw(figure):
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], label=name)
        axes.set(title=name, xlabel=name)
        axes.legend()
        figure.suptitle(name)

    with warnings.catch_warnings():
        warnings.simplefilter('error')
        figure = canvas.figure(3.0, 2.0, draw)
        canvas.write_png(figure, tmp_path / 'figure.png')
        svg = canvas.to_svg(figure)
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert texts.count(shown) == 4
    assert name == shown or name not in texts
    assert (tmp_path / 'figure.png').stat().st_size > 1000
    ElementTree.fromstring(svg)


def one_line(figure):
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], label='a line')
    axes.set_title('title')
    canvas.legend_above(axes)


def test_a_figure_has_its_size_in_inches_at_150_pixels(tmp_path):
    figure = canvas.figure(4.0, 3.0, one_line)
    assert tuple(figure.get_size_inches()) == (4.0, 3.0)
    canvas.write_png(figure, tmp_path / 'figure.png')
    assert cv2.imread(str(tmp_path / 'figure.png')).shape == (450, 600, 3)


def test_the_same_figure_is_the_same_svg_whenever_it_is_drawn():
    first, second = (canvas.to_svg(canvas.figure(4.0, 3.0, one_line)) for _ in range(2))
    assert first == second
    assert first.startswith('<svg') and '<dc:date>' not in first


def test_legends_are_above_the_axes_and_titles_at_the_left():
    figure = canvas.figure(6.0, 3.0, one_line)
    figure.canvas.draw()
    axes, = figure.axes
    assert axes.get_title(loc='left') == 'title'
    box, legend = axes.get_window_extent(), axes.get_legend().get_window_extent()
    assert legend.y0 >= box.y1 - 1 and abs(legend.x1 - box.x1) < 10
    assert not axes.spines['top'].get_visible() and axes.spines['left'].get_visible()


def test_colours_of_series_differ_from_each_other_and_from_that_of_lost_frames():
    assert len({*canvas.SERIES, canvas.LOST, canvas.TRUTH, canvas.MUTED}) == len(canvas.SERIES) + 3


def test_the_style_is_not_left_behind():
    before = dict(matplotlib.rcParams)
    canvas.to_svg(canvas.figure(2.0, 2.0, one_line))
    assert dict(matplotlib.rcParams) == before


def test_the_style_of_the_user_changes_nothing(tmp_path):
    def pictures():
        figure = canvas.figure(3.0, 2.0, lambda figure: figure.subplots().plot([1, 2], label='a'))
        canvas.write_png(figure, tmp_path / 'a.png')
        return canvas.to_svg(figure), (tmp_path / 'a.png').read_bytes()
    expected = pictures()
    with matplotlib.rc_context({'text.usetex': True, 'lines.linewidth': 9, 'savefig.pad_inches': 2,
                                'savefig.bbox': 'tight', 'font.family': 'none'}):
        assert pictures() == expected
