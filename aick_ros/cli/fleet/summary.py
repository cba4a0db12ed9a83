# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Summary of a fleet: mean scores of each variant, failures, and what runs went without."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from aick_ros.cli.output.console import decimal, say, table
from aick_ros.evaluation.runs.table import COVERED, DONE, FAILED, REMARKS, TABLE, UNUSED, Row

REPORT = 'report.html'
_NAMED = 5  # runs of each kind that are named; the table has all


def is_tracked(row: Row) -> bool:
    """Return whether a run has ended with at least one frame that was tracked."""
    return row['status'] == DONE and row.get('tracked') != 0


def show_summary(rows: Sequence[Row], out: Path, on_stderr: bool) -> None:
    """
    Show the mean scores of each variant, and the first runs that failed or lacked something.

    That is a tracked frame, a sensor that was not used, or a part of the recording.

    :param out: folder of the fleet.
    """
    table(f'runs: {len(rows)}',
          (_scores(name, [row for row in rows if row['variant'] == name])
           for name in dict.fromkeys(str(row['variant']) for row in rows)),
          ('settings', 'done', 'failed', 'RPE over 1 s', 'ATE', 'tracked'), on_stderr)
    failed = [row for row in rows if row['status'] == FAILED]
    for row in failed[:_NAMED]:
        say(f'{_name(row)}: {row["cause"]}: {row["reason"]}')
    if failed:
        say(f'{len(failed)} of {len(rows)} runs failed: {out / TABLE} has the reasons')
    untracked = [row for row in rows if row['status'] == DONE and not is_tracked(row)]
    for row in untracked[:_NAMED]:
        say(f'{_name(row)}: no frame was tracked: {out / str(row["run"])} has the reasons')
    if untracked:
        say(f'in {len(untracked)} of {len(rows)} runs no frame was tracked')
    for column, what in ((UNUSED, 'a sensor was not used'),
                         (REMARKS, 'something is wrong with the recording')):
        named = [row for row in rows if row.get(column)]
        for row in named[:_NAMED]:
            say(f'{_name(row)}: {row[column]}')
        if named:
            say(f'in {len(named)} of {len(rows)} runs {what}: {out / TABLE} has the reasons')
    _say_uncovered(rows, out)
    say(f'details: {out / REPORT}')


def _say_uncovered(rows: Sequence[Row], out: Path) -> None:
    """Say in how many runs the errors are of a part of the frames, and name the first ones."""
    uncovered = [(row, covered, frames) for row in rows if row['status'] == DONE
                 if (covered := row.get(COVERED)) is not None
                 and int(covered) < (frames := int(row['frames'] or 0))]
    for row, covered, frames in uncovered[:_NAMED]:
        say(f'{_name(row)}: {covered} of {frames} frames have ground truth: errors are of these '
            'alone')
    if uncovered:
        say(f'in {len(uncovered)} of {len(rows)} runs the ground truth does not cover all frames: '
            f'{out / TABLE} has their number ({COVERED})')


def _name(row: Row) -> str:
    return f'{row["source"]} ({row["variant"]})'


def _scores(name: str, rows: Sequence[Row]) -> tuple[str, ...]:
    def mean(column: str) -> float | None:
        values = [float(value) for row in rows if (value := row.get(column)) is not None]
        return sum(values) / len(values) if values else None
    done = sum(row['status'] == DONE for row in rows)
    return (name, str(done), str(len(rows) - done),
            decimal(mean('trajectory.rpe_1s_translation_rmse_m'), ' m', 4),
            decimal(mean('trajectory.ate_rmse_m'), ' m', 4),
            decimal(mean('trajectory.tracked_fraction'), digits=4))
