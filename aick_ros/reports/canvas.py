# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Style of all figures, and their output as PNG and SVG."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from aick_ros.borders.names import printable
from aick_ros.borders.replacement import replaced

INK = '#1f2933'
MUTED = '#8a94a0'
ESTIMATE = '#1769aa'
SECOND = '#d9822b'
TRUTH = '#52606d'
LOST = '#c62828'
KEYPOINT = '#39ff6a'
SERIES = (SECOND, ESTIMATE, '#2f8f6b', '#7b5aa6')
"""Colours of data series, in order."""

MANY = 20000  # chosen
"""Lines with more points are rasterised, as an SVG would become too large."""

_STYLE: dict[Any, Any] = {
    'axes.edgecolor': MUTED, 'axes.labelcolor': INK, 'axes.titlecolor': INK,
    'axes.titlesize': 11, 'axes.titleweight': 'bold', 'axes.titlelocation': 'left',
    'axes.spines.top': False, 'axes.spines.right': False,
    'axes.grid': True, 'axes.axisbelow': True, 'grid.color': '#e4e7eb', 'grid.linewidth': 0.8,
    'xtick.color': INK, 'ytick.color': INK, 'xtick.labelsize': 9, 'ytick.labelsize': 9,
    'font.size': 10, 'lines.linewidth': 1.4, 'lines.solid_capstyle': 'round',
    'legend.frameon': False, 'legend.fontsize': 9, 'savefig.dpi': 150, 'svg.hashsalt': 'aick',
    'text.parse_math': False,  # names of recordings may have dollar signs
}

Drawing = Callable[[Figure], None]


def figure(width: float, height: float, draw: Drawing) -> Figure:
    """
    Return a figure in the common style; names in its texts are made printable.

    :param width: [inch].
    :param height: [inch].
    :param draw: draws the content into the figure.
    """
    with _style():
        canvas = Figure(figsize=(width, height), layout='constrained')
        FigureCanvasAgg(canvas)
        draw(canvas)
        for text in canvas.findobj(Text):
            text.set_text(printable(text.get_text()))
    return canvas


def to_svg(content: Figure) -> str:
    """Return a figure as an ``<svg>`` element."""
    text = io.StringIO()
    with _drawing(content):
        content.savefig(text, format='svg', metadata={'Date': None})
    svg = text.getvalue()
    return svg[svg.index('<svg'):]


def write_png(content: Figure, path: Path) -> None:
    """
    Write a figure as a PNG file, whole or not at all.

    :raises InputError: where the file cannot be replaced.
    """
    with _drawing(content), replaced(path) as draft:
        content.savefig(draft, format='png')


@contextmanager
def _drawing(content: Figure) -> Iterator[None]:
    """
    Draw in the common style; of characters that no font has a box is enough.

    A figure is laid out before the limits of axes of equal scales are set, whose numbers may be
    longer then: one with such axes is drawn once before, or labels beside them would be cut off.
    """
    with _style(), warnings.catch_warnings():
        warnings.filterwarnings('ignore', 'Glyph .* missing from')
        if any(axes.get_aspect() != 'auto' for axes in content.axes):
            content.draw_without_rendering()
        yield


@contextmanager
def _style() -> Iterator[None]:
    """Use the common style, without that of the user, which may need programs or fail."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def legend_above(axes: Axes) -> None:
    """Place the legend above the axes at the right, outside of the data."""
    axes.legend(loc='lower right', bbox_to_anchor=(1.0, 1.0), ncols=4, borderaxespad=0.2,
                handlelength=1.4, columnspacing=1.2)
