# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Figures of a benchmark: success ratios over thresholds and time, for methods and settings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aick_ros.evaluation.benchmark.figures import THRESHOLD, Axis
from aick_ros.reports import canvas

_COLOURS = {
    'aick': '#0b3c5d', 'aick-orb': '#1769aa', 'aick-orb-350': '#4f9bd9',
    'aick-orb-fast': '#8fc3ee', 'aick-surf': '#1b7a43', 'aick-surf-200': '#4fb477',
    'aick-surf-fast': '#9bd8b0', 'ransac3': '#d9822b', 'ransac3-orb': '#f0b27a',
    'pnp': '#8c5a2b', 'gicp': '#c62828', 'gicp-tuned': '#ef7070', 'ndt': '#6a3fa0',
    'ndt-tuned': '#a987d3', 'small-gicp': '#c62878', 'open3d-hybrid': '#7a7f00',
    'open3d-plane': '#b5ba3c', 'opencv-depth': '#00897b', 'opencv-rgbd': '#63c5ba'}
"""Colour of each method in all figures."""

_MARKERS = 'osD^vPX*'
_SIZE = 5.0, 3.9  # width and height of a panel [inch]
_LABELS = {Axis.THRESHOLD.value: 'threshold on the translation error [mm]',
           Axis.GAP.value: 'time between the frames [ms]'}


def write_figures(figures: Mapping[str, Any], recordings: Mapping[str, Any],
                  folder: Path) -> list[Path]:
    """
    Draw the figures of a benchmark into PNG files.

    :param figures: number -> data, as the JSON of ``aick benchmark`` has it.
    :param recordings: name -> number of frames and period, from the same JSON.
    :param folder: an existing folder.
    :returns: the paths of the files, in the order of the figures.
    """
    paths = []
    for number, content in figures.items():
        paths.append(folder / f'figure-{number}.png')
        canvas.write_png(_figure(content, recordings), paths[-1])
    return paths


def _figure(content: Mapping[str, Any], recordings: Mapping[str, Any]) -> Figure:
    columns = min(len(recordings), 2)
    rows = -(-len(recordings) // columns)
    title = _title(content)
    if columns == 1:  # too narrow for a line
        title = title.replace('; ', ';\n')

    def draw(figure: Figure) -> None:
        panels = figure.subplots(rows, columns, squeeze=False, sharey=True)
        for axes, name in zip(panels.flat, recordings):
            _draw(axes, content, name, recordings[name]['period_ms'])
        for axes in panels.flat[len(recordings):]:
            axes.set_axis_off()
        for axes in panels[:, 0]:
            axes.set_ylabel('success ratio')
        figure.suptitle(title, fontsize=12, fontweight='bold', color=canvas.INK)
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc='outside lower center', ncols=4)

    return canvas.figure(max(_SIZE[0] * columns, 6.5), 0.7 + _SIZE[1] * rows, draw)


def _title(content: Mapping[str, Any]) -> str:
    title = str(content['title'])
    if content['axis'] == Axis.THRESHOLD.value:
        return title
    return f'{title}; success within {1e3 * THRESHOLD:g} mm'


def _draw(axes: Axes, content: Mapping[str, Any], recording: str, period: float) -> None:
    is_threshold = content['axis'] == Axis.THRESHOLD.value
    scale = 1e3 if is_threshold else period
    for place, (name, curve) in enumerate(content['curves'].items()):
        points = curve['recordings'].get(recording)
        if points is None:
            continue
        axes.plot(scale * np.array(points['x']), points['success_ratio'], label=curve['label'],
                  color=_colour(name, place, len(content['curves'])), markersize=4.5,
                  marker='' if is_threshold else _MARKERS[place % len(_MARKERS)])
    if is_threshold:
        axes.axvline(1e3 * THRESHOLD, color=canvas.LOST, linewidth=1.0, linestyle='--')
    axes.set(title=recording, xlabel=_LABELS[content['axis']], ylim=(-0.02, 1.02), xlim=(0, None))


def _colour(name: str, place: int, count: int) -> Any:
    """Return the colour of a method, or one of a colour map where settings are varied."""
    if name in _COLOURS:
        return _COLOURS[name]
    return colormaps['viridis'](0.9 * (1 - place / max(count - 1, 1)))
