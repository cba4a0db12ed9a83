# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Comparison of runs as one HTML file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from aick_ros.evaluation.comparison.comparison import (
    BLOCK, CONFIDENCE, Change, Comparison, Verdict)
from aick_ros.evaluation.comparison.metrics import Metric
from aick_ros.reports import canvas, page

_COLOURS = {Verdict.WORSE: canvas.LOST, Verdict.BETTER: canvas.SERIES[2]}
_ROW_HEIGHT = 0.3  # [inch]; chosen
_HEAD = ('baseline', 'candidate', 'change', f'{CONFIDENCE:.0%} interval', 'verdict')


def comparison_page(baseline: str, comparisons: Mapping[str, Comparison]) -> str:
    """
    Return the comparison of candidates with a baseline, a self-contained HTML page.

    :param baseline: where its runs are.
    :param comparisons: where the runs of a candidate are -> its comparison.
    """
    parts = [page.heading('Comparison of runs', 1),
             page.paragraph(f'Baseline: {baseline}', 'quiet'),
             page.paragraph(
                 f'Intervals are those of a bootstrap over blocks of {BLOCK:g} s, the same blocks '
                 'of both runs: what other parts of the same recordings would give. A change is '
                 'better or worse where its interval excludes zero. Times and memory depend on '
                 'the machine and its load, and are not tested.', 'quiet')]
    for candidate, comparison in comparisons.items():
        parts += _candidate(candidate, comparison)
    return page.page('Comparison of runs', *parts, sorts_tables=True)


def change_text(metric: Metric, change: float) -> str:
    """Return a change for people, in per cent or in percentage points (pp)."""
    return f'{100 * change:+.1f} {"%" if metric.is_relative else "pp"}'


def value_text(metric: Metric, value: float) -> str:
    """Return a value of a metric for people."""
    return f'{value:.4g} {metric.unit}'.rstrip()


def cells(metric: Metric, change: Change) -> tuple[str, ...]:
    """Return baseline, candidate, change, interval and verdict for people."""
    return (value_text(metric, change.baseline), value_text(metric, change.candidate),
            change_text(metric, change.change),
            f'{change_text(metric, change.low)} to {change_text(metric, change.high)}',
            change.verdict.value)


def _candidate(name: str, comparison: Comparison) -> Iterator[str]:
    yield page.heading(name)
    for sentence in comparison.one_sided('the baseline', 'the candidate'):
        yield page.paragraph(f'{sentence[0].upper()}{sentence[1:]}.', 'notice')
    count = len(comparison.recordings)
    yield page.paragraph(f'{count} recordings' if count > 1 else f'Recording: '
                         f'{next(iter(comparison.recordings))}')
    yield page.table(('metric', *_HEAD), ((metric.title, *cells(metric, change))
                                          for metric, change in comparison.total.items()))
    yield from _settings(comparison)
    if count > 1:
        for metric in comparison.total:
            yield from _recordings(metric, comparison)


def _settings(comparison: Comparison) -> Iterator[str]:
    yield page.heading('Settings that differ', 3)
    rows = [(name, str(first), str(second))
            for name, (first, second) in comparison.settings.items()]
    yield page.table(('setting', 'baseline', 'candidate'), rows) if rows else (
        page.paragraph('None.', 'quiet'))


def _recordings(metric: Metric, comparison: Comparison) -> Iterator[str]:
    """Yield picture and table of a metric on each recording."""
    changes = {name: of_one[metric] for name, of_one in comparison.recordings.items()
               if metric in of_one}
    yield page.heading(f'{metric.title[0].upper()}{metric.title[1:]}', 3)
    height = 0.9 + _ROW_HEIGHT * len(changes)
    yield page.picture(canvas.to_svg(canvas.figure(9.0, height, partial(_draw, metric, changes))))
    yield page.table(('recording', *_HEAD), ((name, *cells(metric, change))
                                             for name, change in changes.items()),
                     is_sortable=True)


def _draw(metric: Metric, changes: Mapping[str, Change], figure: Figure) -> None:
    """Draw the change on each recording with its interval, the first one on top."""
    axes = figure.add_subplot()
    rows = np.arange(len(changes))[::-1]
    for row, change in zip(rows, changes.values()):
        colour = _COLOURS.get(change.verdict, canvas.MUTED)
        axes.plot([100 * change.low, 100 * change.high], [row, row], color=colour, linewidth=2)
        axes.plot(100 * change.change, row, 'o', color=colour)
    axes.axvline(0, color=canvas.INK, linewidth=0.8)
    axes.set_yticks(rows, list(changes))
    axes.set_ylim(-0.7, len(changes) - 0.3)
    axes.set_xlabel(f'change [{"%" if metric.is_relative else "percentage points"}], '
                    'better to the left')
