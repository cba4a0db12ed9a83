# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Runs of a fleet as one HTML file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from aick_ros.evaluation.runs.table import COVERED, DONE, FAILED, REMARKS, UNUSED, Row
from aick_ros.reports import canvas, page

_MOST_LISTED = 200  # chosen
_LONGEST_LABEL = 40  # characters, two in a row; chosen
_WIDE = 10.0  # ratio; chosen: on a narrower logarithmic axis 1, 2 and 5 may be one label or none
_MOST_TICKS = 5  # of such an axis; chosen
_LEAST_ERROR = 1e-9  # [m or deg] for logarithmic axes; chosen

_SCORES = {
    'trajectory.rpe_1s_translation_rmse_m': ('RPE over 1 s [mm]', 1e3, '.2f'),
    'trajectory.rpe_1s_rotation_rmse_deg': ('RPE over 1 s [deg]', 1.0, '.3f'),
    'trajectory.ate_rmse_m': ('ATE [mm]', 1e3, '.1f'),
    'trajectory.tracked_fraction': ('tracked [%]', 1e2, '.1f'),
    'consistency.inside_95': ('inside 95 % [%]', 1e2, '.1f'),
    'timing_ms.total.p50': ('median time [ms]', 1.0, '.1f'),
    'peak_memory_mb': ('peak memory [MB]', 1.0, '.0f'),
}
"""Column of the table of runs -> its head on the page, factor and format."""

_DRAWN = tuple(_SCORES)[:3]

_OF_SENSORS = {'source': 'source', 'variant': 'settings', UNUSED: 'reason'}
_OF_REMARKS = {'source': 'source', 'variant': 'settings', REMARKS: 'remarks'}
_OF_FAILURES = {'source': 'source', 'variant': 'settings', 'cause': 'cause', 'reason': 'reason',
                'attempts': 'attempts'}
"""Column of the table of runs -> its head in a list of some of them."""


def fleet_page(rows: Sequence[Row]) -> str:
    """
    Return the runs of a fleet, a self-contained HTML page.

    :param rows: of the table of runs.
    """
    done = [row for row in rows if row['status'] == DONE]
    failed = [row for row in rows if row['status'] == FAILED]
    of_variant = {name: [row for row in done if row['variant'] == name]
                  for name in dict.fromkeys(str(row['variant']) for row in rows)}
    parts = [page.heading('Runs of a fleet', 1), page.tiles(_tiles(rows, done, failed)),
             *_variants(of_variant, failed), *_pictures(of_variant), *_runs(done),
             *_listed('Sensors that are not used', _OF_SENSORS,
                      [row for row in done if row.get(UNUSED)]),
             *_listed('Remarks on recordings', _OF_REMARKS,
                      [row for row in done if row.get(REMARKS)]),
             *_listed('Failures', _OF_FAILURES, failed)]
    return page.page('Runs of a fleet', *parts, sorts_tables=True)


def _tiles(rows: Sequence[Row], done: Sequence[Row],
           failed: Sequence[Row]) -> Iterator[tuple[str, str]]:
    yield 'runs', str(len(rows))
    yield 'recordings', str(len({row['source'] for row in rows}))
    yield 'failed', str(len(failed))
    yield 'frames', f'{sum(_numbers(done, "frames")):.0f}'
    yield 'hours recorded', f'{sum(_numbers(done, "duration_s")) / 3600:.2f}'


def _variants(of_variant: Mapping[str, Sequence[Row]], failed: Sequence[Row]) -> Iterator[str]:
    yield page.heading('Settings')
    yield page.paragraph('Means over the recordings that were run to their end.', 'quiet')
    heads = ('settings', 'done', 'failed', *(head for head, _, _ in _SCORES.values()))
    yield page.table(heads, (
        (name, str(len(rows)), str(sum(row['variant'] == name for row in failed)),
         *(_text(column, _mean(rows, column)) for column in _SCORES))
        for name, rows in of_variant.items()), is_sortable=True)


def _pictures(of_variant: Mapping[str, Sequence[Row]]) -> Iterator[str]:
    drawn = [column for column in _DRAWN
             if any(_numbers(rows, column) for rows in of_variant.values())]
    if not drawn:
        return
    yield page.heading('Errors of all recordings')
    yield page.paragraph('Share of the recordings whose error is at most that on the horizontal '
                         'axis: the further to the left, the better.', 'quiet')
    draw = partial(_draw, of_variant, drawn)
    yield page.picture(canvas.to_svg(canvas.figure(9.0, 3.4, draw)))


def _draw(of_variant: Mapping[str, Sequence[Row]], columns: Sequence[str],
          figure: Figure) -> None:
    """Draw the distribution of each error, a curve for each variant."""
    every = np.atleast_1d(figure.subplots(1, len(columns), sharey=True))
    for axes, column in zip(every, columns):
        head, factor, _ = _SCORES[column]
        for number, (name, rows) in enumerate(of_variant.items()):
            errors = np.sort(np.maximum(_numbers(rows, column), _LEAST_ERROR)) * factor
            steps = np.concatenate([errors[:1], errors])  # none of settings without an error
            shares = 100 * np.arange(len(steps)) / max(len(errors), 1)
            colour = (f'C{number}' if number >= len(canvas.SERIES) else canvas.SERIES[number])
            axes.step(steps, shares, where='post', label=name[:_LONGEST_LABEL], color=colour)
        axes.set_xscale('log')
        low, high = axes.get_xlim()
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5), numticks=12)
                                     if high > _WIDE * low else MaxNLocator(_MOST_TICKS))
        axes.xaxis.set_major_formatter(lambda value, _: f'{value:g}')
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel(head)
    every[0].set_ylabel('recordings [%]')
    every[0].set_ylim(0, 100)
    if 1 < len(of_variant) <= 10:
        figure.legend(*every[0].get_legend_handles_labels(), loc='outside upper left', ncols=2)


def _runs(done: Sequence[Row]) -> Iterator[str]:
    yield page.heading('Runs')
    yield page.table(('recording', 'settings', 'frames',
                      *(head for head, _, _ in _SCORES.values()), 'frames with ground truth'), (
        (str(row['recording']), str(row['variant']), str(row['frames']),
         *(_text(column, row.get(column)) for column in _SCORES), _covered(row)) for row in done),
        is_sortable=True)


def _covered(row: Row) -> str:
    """Return the number of frames that the ground truth covers; empty without one."""
    covered = row.get(COVERED)
    return '' if covered is None else str(covered)


def _listed(heading: str, columns: Mapping[str, str], rows: Sequence[Row]) -> Iterator[str]:
    """Yield a list of runs, if there are any."""
    if not rows:
        return
    yield page.heading(heading)
    yield page.table(tuple(columns.values()), (
        tuple(str(row.get(column, '')) for column in columns) for row in rows[:_MOST_LISTED]),
        is_sortable=True)
    if len(rows) > _MOST_LISTED:
        yield page.paragraph(f'{len(rows) - _MOST_LISTED} more are in the table of runs.', 'quiet')


def _numbers(rows: Sequence[Row], column: str) -> list[float]:
    return [float(value) for row in rows if (value := row.get(column)) is not None]


def _mean(rows: Sequence[Row], column: str) -> float | None:
    values = _numbers(rows, column)
    return sum(values) / len(values) if values else None


def _text(column: str, value: str | float | None) -> str:
    _, factor, digits = _SCORES[column]
    return '' if value is None else format(factor * float(value), digits)
