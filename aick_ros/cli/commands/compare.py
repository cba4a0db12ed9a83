# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick compare``: what got better or worse between runs, beyond chance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli import exit_codes
from aick_ros.cli.input import options
from aick_ros.cli.output.console import say, table
from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.cli.output.target import STANDARD_OUTPUT, check_target
from aick_ros.errors import InputError, installation, package_of
from aick_ros.evaluation.comparison.comparison import CONFIDENCE, Baseline, Comparison
from aick_ros.evaluation.runs.run import Run, read_run, run_folders

Runs = Annotated[list[Path], typer.Argument(
    metavar='RUN RUN...', show_default=False,
    help='Folders of runs of aick replay, folders of such folders, or tables of aick fleet; the '
         'first is the baseline.')]
Out = Annotated[Path, typer.Option('--out', metavar='FILE', help='HTML page to be written.')]
FailOnRegression = Annotated[bool, typer.Option(
    '--fail-on-regression', help='Exit with 3 if a metric became worse over all recordings, or a '
                                 'candidate lacks frames of the baseline.')]

_NAMED = 3  # chosen: recordings in a sentence on the terminal; page and JSON name all


def compare(runs: Runs, out: Out = Path('comparison.html'), json: options.JsonFile = None,
            fail_on_regression: FailOnRegression = False) -> int:
    """
    Compare runs with a baseline: accuracy, consistency, lost frames, time and memory.

    Runs are of the same recording if it has the same name. Errors need ground truth, which a run
    of aick replay has if its recording had it.
    """
    if len(runs) < 2:
        raise InputError('at least two runs are required, the baseline first')
    if str(out) == STANDARD_OUTPUT:
        raise InputError('the page cannot go to standard output: give --out a file; --json - is '
                         'for other programs')
    inputs = [folder for path in runs for folder in run_folders(path)]
    check_target(json, *inputs)
    check_target(str(out), *inputs)
    if json is not None and Path(json).resolve() == out.resolve():
        raise InputError(f'--json and --out are both {out}: name two files')
    baseline = Baseline(_read(runs[0]))
    comparisons = {str(path): _compared(runs[0], baseline, path) for path in runs[1:]}
    if json is not None:
        write_json(json, {'baseline': str(runs[0]), 'candidates': {
            name: comparison.to_json() for name, comparison in comparisons.items()}})
    _show(comparisons, out, str(runs[0]), on_stderr=json == STANDARD_OUTPUT)
    regressions = [text for name, comparison in comparisons.items()
                   for text in _regressions(name, comparison)]
    if fail_on_regression and regressions:
        say(f'worse than {runs[0]}: {"; ".join(regressions)}')
        return exit_codes.REGRESSION
    return exit_codes.DONE


def _regressions(name: str, comparison: Comparison) -> Iterator[str]:
    """Yield what became worse with a candidate."""
    for metric in comparison.regressions:
        yield f'{metric.title} of {name}'
    if comparison.is_incomplete:
        yield f'frames that {name} lacks'


def _read(path: Path) -> dict[str, Run]:
    """Return the newest run of each recording."""
    folders = run_folders(path)
    runs = {run.source: run for run in map(read_run, folders)}
    if len(runs) < len(folders):
        say(f'{path} has several runs of a recording: the last by name is compared')
    return runs


def _compared(path: Path, baseline: Baseline, candidate: Path) -> Comparison:
    comparison = baseline.compare(_read(candidate))
    if not comparison.recordings:
        raise InputError(f'{path} and {candidate} have no recording in common: compare runs '
                         'of the same recordings')
    if not comparison.total:
        raise InputError(f'{path} and {candidate} have no frame in common: compare runs of '
                         'the same recordings')
    return comparison


def _show(comparisons: Mapping[str, Comparison], out: Path, baseline: str,
          on_stderr: bool) -> None:
    """Write the page, and show the changes over all recordings."""
    try:
        from aick_ros.reports.comparison_page import cells, comparison_page
    except ModuleNotFoundError as error:
        raise InputError(f"no page without {package_of(error)}: {installation('eval')}") from None
    write_whole(out, comparison_page(baseline, comparisons))
    for name, comparison in comparisons.items():
        table(f'{name} against {baseline}',
              ((metric.title, *cells(metric, change))
               for metric, change in comparison.total.items()),
              columns=('', 'baseline', 'candidate', 'change', f'{CONFIDENCE:.0%} interval', ''),
              on_stderr=on_stderr)
        for sentence in comparison.one_sided(baseline, name, _NAMED):
            say(sentence)
    say(f'details: {out}')
