# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plot of a trajectory from above and from the side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.reports import canvas

_PATH, _STRIP, _TITLE = 4.5, 2.0, 0.3  # heights [inch]
_VIEWS = {'From above': (0, 1), 'From the side': (0, 2)}


@dataclass(frozen=True, eq=False)
class View:
    """
    An image of the camera with its keypoints.

    :param image: HxWx3 (red, green, blue) or HxW uint8.
    :param keypoints: Nx2 (u, v) [px].
    """

    image: np.ndarray
    keypoints: np.ndarray


def plot_trajectory(path_png: Path, estimate: Trajectory, ground_truth: Trajectory | None = None,
                    title: str = '', views: Sequence[View] = ()) -> None:
    """
    Write a plot of a trajectory as PNG.

    :param estimate: in a frame with z up; it is aligned to the ground truth, if there is one.
    :param ground_truth: in a world frame with z up, or None.
    :param views: shown side by side above the plot.
    """
    canvas.write_png(path_figure(estimate, ground_truth, title=title, views=views), path_png)


def path_figure(estimate: Trajectory, ground_truth: Trajectory | None = None,
                lost: np.ndarray | None = None, title: str = '',
                views: Sequence[View] = ()) -> Figure:
    """
    Return a plot of a trajectory from above (x, y) and from the side (x, z).

    :param estimate: in a frame with z up; it is aligned to the ground truth, if there is one.
    :param ground_truth: in a world frame with z up, or None.
    :param lost: N bool, poses of lost frames, which are marked.
    :param views: shown side by side above the plot.
    """
    errors = compare(estimate, ground_truth) if ground_truth is not None else None
    positions, true_positions = estimate.poses[:, :3, 3], None
    if ground_truth is not None and errors is not None:
        positions = (errors.T_world_odom @ estimate.poses)[:, :3, 3]
        inside = slice(*np.searchsorted(ground_truth.stamps, estimate.stamps[[0, -1]]))
        true_positions = ground_truth.poses[inside, :3, 3]

    def draw(figure: Figure) -> None:
        below: Figure | SubFigure = figure
        if views:
            above, below = np.asarray(
                figure.subfigures(2, 1, height_ratios=(_STRIP, _PATH)), object)
            _draw_strip(above, views)
        both = below.subplots(1, 2)
        for axes, (name, view) in zip(both, _VIEWS.items()):
            _draw_view(axes, positions[:, view], lost,
                       None if true_positions is None else true_positions[:, view])
            axes.set(title=name, xlabel='x [m]', ylabel=f'{"xyz"[view[1]]} [m]')
        handles, labels = both[0].get_legend_handles_labels()
        below.legend(handles, labels, loc='outside lower center', ncols=len(labels))
        if title:
            figure.suptitle(title, fontsize=12, fontweight='bold', color=canvas.INK)

    height = _PATH + (_STRIP if views else 0.0) + (_TITLE if title else 0.0)
    return canvas.figure(10.0, height, draw)


def _draw_strip(figure: SubFigure, views: Sequence[View]) -> None:
    for axes, view in zip(figure.subplots(1, len(views), squeeze=False)[0], views):
        axes.imshow(view.image, cmap='gray')
        axes.plot(*view.keypoints.T, '.', color=canvas.KEYPOINT, markersize=2.0)
        axes.set_axis_off()


def _draw_view(axes: Axes, positions: np.ndarray, lost: np.ndarray | None,
               true_positions: np.ndarray | None) -> None:
    many = len(positions) > canvas.MANY
    if true_positions is not None:
        axes.plot(*true_positions.T, color=canvas.TRUTH, linewidth=3.0, alpha=0.35,
                  rasterized=many, label='ground truth')
    axes.plot(*positions.T, color=canvas.ESTIMATE, rasterized=many, label='estimate')
    if lost is not None and lost.any():
        axes.plot(*positions[lost].T, '.', color=canvas.LOST, rasterized=many,
                  label='lost, pose held')
    axes.plot(*positions[0], 'o', color='white', markeredgecolor=canvas.INK, markersize=7,
              label='start')
    axes.plot(*positions[-1], 's', color=canvas.INK, markersize=6, label='end')
    axes.set_aspect('equal', adjustable='datalim')
    axes.margins(0.08)
