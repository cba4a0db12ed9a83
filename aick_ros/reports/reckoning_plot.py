# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Figure 10 of the paper: points and path of dead reckoning, from three sides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aick_ros.evaluation.benchmark.dead_reckoning import Reckoning
from aick_ros.reports import canvas

_RESOLUTION = 0.01  # [m] per pixel
_BACKGROUND = 255

_VIEWS = {
    'From above': ('x', 'y', 1.0),
    'From the front': ('x', 'z', -1.0),
    'Along the shelves': ('y', 'z', -1.0),
}
"""Title -> axis to the right, axis up, and side of the third axis on which the viewer stands."""


def write_reckoning(reckoning: Reckoning, path: Path) -> None:
    """Write the points and the path, from above, from the front and along the shelves."""
    end = reckoning.end

    def draw(figure: Figure) -> None:
        grid = figure.add_gridspec(3, 1, height_ratios=(1.0, 1.0, 2.2))
        above, front, along = (figure.add_subplot(grid[row]) for row in range(3))
        for axes, (title, view) in zip((above, front, along), _VIEWS.items()):
            _draw(axes, reckoning, *view)
            axes.set_title(title)
        handles, labels = above.get_legend_handles_labels()
        figure.legend(handles, labels, loc='outside lower center', ncols=2)
        figure.suptitle(
            f'{end.frames} frames, {end.length_m:.1f} m by dead reckoning: error at the end '
            f'{end.error_m:.2f} m and {end.error_deg:.1f} deg', fontsize=12, fontweight='bold',
            color=canvas.INK)

    canvas.write_png(canvas.figure(10.0, 8.0, draw), path)


def splat(points: np.ndarray, colours: np.ndarray, right: int, up: int,
          side: float) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """
    Return an orthographic image of points; near points hide far ones.

    :param right: index of the axis to the right.
    :param up: index of the axis up.
    :param side: side of the third axis on which the viewer stands, 1 or -1.
    :returns: HxWx3 uint8, and its left, right, bottom and top [m].
    """
    plane = points[:, [right, up]]
    low = plane.min(axis=0)
    columns, rows = np.floor((plane - low) / _RESOLUTION).astype(int).T
    picture = np.full((rows.max() + 1, columns.max() + 1, 3), _BACKGROUND, np.uint8)
    order = np.argsort(side * points[:, 3 - right - up], kind='stable')  # near ones last
    picture[rows[order], columns[order]] = colours[order]
    extent = low[0], low[0] + picture.shape[1] * _RESOLUTION, low[1], \
        low[1] + picture.shape[0] * _RESOLUTION
    return picture[::-1], extent


def _draw(axes: Axes, reckoning: Reckoning, right: str, up: str, side: float) -> None:
    i, j = 'xyz'.index(right), 'xyz'.index(up)
    picture, extent = splat(reckoning.points, reckoning.colours, i, j, side)
    axes.imshow(picture, extent=extent, interpolation='nearest')
    axes.plot(*reckoning.true_positions[:, [i, j]].T, color=canvas.TRUTH, linewidth=3.0,
              alpha=0.35, label='true path')
    axes.plot(*reckoning.positions[:, [i, j]].T, color=canvas.ESTIMATE, label='dead reckoning')
    axes.set(xlabel=f'{right} [m]', ylabel=f'{up} [m]')
    axes.grid(False)
    axes.set_aspect('equal')
    axes.autoscale_view()
