# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names of recordings in figures."""

import warnings
from xml.etree import ElementTree

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
