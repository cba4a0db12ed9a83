# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Histogram of the NEES, which shows whether covariances are consistent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from aick_ros.evaluation.scores.consistency import (
    DOF, QUANTILE_95, QUANTILE_997, Consistency, density)
from aick_ros.reports import canvas

_END = 24.0  # of the axis; with correct covariances 0.05 % of the values are larger
_TICKS = (0, 6, 12, 18, 24)
_BEYOND = 25.5  # position of the bar of the larger values
_WIDTH = 1.0  # of a bar


def nees_figure(values: Sequence[float], title: str, noun: str = 'increments') -> Figure:
    """
    Return the histogram of NEES and the density for correct covariances.

    :param values: at least one; infinite ones count as beyond the axis.
    :param noun: of what the values are, in the plural.
    """
    nees = np.asarray(values, np.float64)
    edges = np.arange(0.0, _END + _WIDTH, _WIDTH)
    shares = 100 * np.histogram(nees, edges)[0] / len(nees)
    beyond = 100 * float(np.mean(nees > _END))

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.bar(edges[:-1] + _WIDTH / 2, shares, 0.9 * _WIDTH, color=canvas.ESTIMATE,
                 alpha=0.75, label='measured')
        axes.bar(_BEYOND, beyond, 0.9 * _WIDTH, color=canvas.LOST, alpha=0.75)
        axes.annotate(f'{beyond:.1f} %', (_BEYOND, beyond), (0, 2), textcoords='offset points',
                      ha='center', va='bottom', fontsize=9, color=canvas.INK)
        curve = np.linspace(0.0, _END, 300)
        axes.plot(curve, 100 * _WIDTH * density(curve), color=canvas.SECOND, linewidth=2.2,
                  label='correct covariances')
        _mark(axes, QUANTILE_95, '95 %')
        _mark(axes, QUANTILE_997, '99.7 %')
        axes.set_xticks([*_TICKS, _BEYOND], [*map(str, _TICKS), 'beyond'])
        axes.set(title=title, xlabel=f'NEES, 6 degrees of freedom\n{_sentence(nees, noun)}',
                 ylabel=f'% of the {noun}', xlim=(0.0, _BEYOND + _WIDTH))
        axes.margins(y=0.08)
        canvas.legend_above(axes)

    return canvas.figure(10.0, 4.0, draw)


def _mark(axes: Axes, quantile: float, share: str) -> None:
    axes.axvline(quantile, color=canvas.MUTED, linestyle='--', linewidth=1.0)
    axes.annotate(share, (quantile, 1.0), (4, -2), xycoords=('data', 'axes fraction'),
                  textcoords='offset points', va='top', fontsize=9, color=canvas.TRUTH)


def _sentence(values: np.ndarray, noun: str) -> str:
    mean = Consistency.of(values).nees_mean
    return (f'{len(values)} {noun}, mean {"-" if mean is None else f"{mean:.1f}"} (correct: '
            f'{DOF}), inside the 95 % ellipsoid {100 * np.mean(values <= QUANTILE_95):.1f} %')
