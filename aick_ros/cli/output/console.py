# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Terminal output: messages and progress on standard error, tables on standard output."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from aick_ros.borders.names import one_line, printable

_UPDATE_INTERVAL = 0.2  # [s]; chosen
_LONGEST_NAME = 24  # characters that a narrow table does not break; chosen: paths are longer


class _Console(Console):
    """A console that leaves a closed pipe to its caller; rich would exit, with code 1."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError


def _console(stderr: bool) -> Console:
    """Return a console that prints text as it is."""
    return _Console(stderr=stderr, markup=False, highlight=False, emoji=False)


_ERRORS = _console(stderr=True)


def say(text: str) -> None:
    """Print one line on standard error, where that can be written to."""
    with suppress(OSError):
        _ERRORS.print(f'aick: {one_line(text)}', soft_wrap=True)


@contextmanager
def progress(title: str, total: int, unit: str = 'frames') -> Iterator[Callable[[int], None]]:
    """
    Show a progress bar on a terminal while the block runs.

    :param unit: plural noun of what is counted.
    :returns: a function to be called with the number of units done, cheap enough for each one.
    """
    if not _ERRORS.file.isatty():  # FORCE_COLOR is for colours, a bar moves the cursor
        yield lambda done: None
        return
    columns = (TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
               TextColumn('{task.fields[rate]:.0f} {task.fields[unit]}/s'),
               TimeRemainingColumn())
    with Progress(*columns, console=_ERRORS, transient=True, refresh_per_second=5) as bar:
        task = bar.add_task(printable(title), total=total, rate=0.0, unit=unit)
        start = shown = time.monotonic()

        def show(done: int) -> None:
            nonlocal shown
            now = time.monotonic()
            if now - shown > _UPDATE_INTERVAL:
                shown = now
                bar.update(task, completed=done, rate=done / (now - start))

        yield show


def table(title: str, rows: Iterable[Iterable[str]], columns: Sequence[str] = ('', ''),
          on_stderr: bool = False) -> None:
    """
    Print a table, its first column to the left, the others to the right.

    Where it is too wide for the terminal, cells and heads are folded, but no words or numbers in
    them; nothing is cut off, even if lines are longer than the terminal is wide.

    :param columns: heads of the columns; not shown where all are empty.
    :param on_stderr: print on standard error, where JSON goes to standard output.
    """
    content = Table(title=printable(title), title_justify='left', title_style='bold', box=None,
                    pad_edge=False, show_header=any(columns), header_style='dim')
    cells = [[printable(cell) for cell in row] for row in rows]
    names = max((len(row[0]) for row in cells), default=0)
    for number, column in enumerate(columns):
        words = (word for cell in (column, *(row[number] for row in cells))
                 for word in cell.split())
        widest = max(map(len, words), default=0) if number else names
        content.add_column(column, justify='right' if number else 'left', overflow='fold',
                           min_width=min(widest, _LONGEST_NAME))
    for row in cells:
        content.add_row(*row)
    with suppress(OSError) if on_stderr else nullcontext():
        (_ERRORS if on_stderr else _console(stderr=False)).print(content, crop=False)


def line(text: str, on_stderr: bool = False) -> None:
    """Print a line, on standard error where that can be written to."""
    with suppress(OSError) if on_stderr else nullcontext():
        typer.echo(text, err=on_stderr)


def decimal(value: float | None, unit: str = '', digits: int = 3) -> str:
    """Return a number with fixed decimals for a table; a dash for None."""
    return '-' if value is None else f'{value:.{digits}f}{unit}'
