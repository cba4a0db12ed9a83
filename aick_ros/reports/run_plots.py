# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plots of a run over time: errors, keypoints, matches, stage times."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aick_ros.evaluation.scores.frame_record import FrameRecord, stages_of
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.reports import canvas

_SHARES = 401  # chosen: points of a curve, however many frames there are


def error_figure(errors: TrajectoryErrors, start: int) -> Figure:
    """
    Return the error of position and rotation over time, after alignment.

    :param start: stamp of time 0 [ns].
    """
    times = _times(errors.estimate.stamps, start)

    def draw(figure: Figure) -> None:
        upper, lower = figure.subplots(2, 1, sharex=True)
        many = len(times) > canvas.MANY
        upper.plot(times, 100 * errors.positions(), color=canvas.ESTIMATE, rasterized=many)
        lower.plot(times, np.degrees(errors.rotations()), color=canvas.SECOND, rasterized=many)
        upper.set(title='Position error', ylabel='error [cm]', ylim=(0, None))
        lower.set(title='Rotation error', ylabel='error [deg]', ylim=(0, None), xlabel='time [s]')

    return canvas.figure(10.0, 4.2, draw)


def tracking_figure(records: Sequence[FrameRecord]) -> Figure:
    """Return the keypoints and matches over time; lost frames are shaded."""
    times = _times(np.array([record.stamp for record in records]), records[0].stamp)
    lost = np.array([not record.status.ok for record in records])

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        many = len(times) > canvas.MANY
        axes.plot(times, [record.keypoints for record in records], color=canvas.MUTED,
                  rasterized=many, label='keypoints with depth')
        axes.plot(times, [record.matches for record in records], color=canvas.ESTIMATE,
                  rasterized=many, label='matches')
        _shade(axes, times, lost)
        axes.set(title='Keypoints and matches', ylabel='number', ylim=(0, None),
                 xlabel='time [s]')
        canvas.legend_above(axes)

    return canvas.figure(10.0, 3.2, draw)


def timing_figure(records: Sequence[FrameRecord]) -> Figure:
    """Return the share of the frames that take at most a time, for each stage."""
    times = {stage: np.array([record.timing[stage] for record in records
                              if stage in record.timing])
             for stage in stages_of(records) if stage != 'total'}
    longest = max(float(np.percentile(values, 99.5)) for values in times.values())
    shares = np.linspace(0.0, 100.0, _SHARES)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for (stage, values), colour in zip(times.items(), cycle(canvas.SERIES)):
            axes.plot(np.percentile(values, shares), shares, color=colour, label=stage)
        axes.set(title='Time per frame', xlabel='time [ms]', ylabel='frames [%]',
                 xlim=(0, 1.05 * longest), ylim=(0, 100))
        canvas.legend_above(axes)

    return canvas.figure(10.0, 3.0, draw)


def _times(stamps: np.ndarray, start: int) -> np.ndarray:
    return (stamps - start) / NANOSECONDS


def _shade(axes: Axes, times: np.ndarray, lost: np.ndarray) -> None:
    """Shade each sequence of lost frames, up to the frame after it."""
    edges = np.flatnonzero(np.diff(np.r_[False, lost, False].astype(np.int8)))
    for i, (first, after) in enumerate(edges.reshape(-1, 2)):
        end = times[min(after, len(times) - 1)]
        axes.axvspan(times[first], end, color=canvas.LOST, alpha=0.18, linewidth=0,
                     label='lost' if i == 0 else None)
