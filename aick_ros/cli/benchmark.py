# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick benchmark``: methods side by side on the same pairs of frames."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli import options, outcome
from aick_ros.cli.console import figure, progress, say, table
from aick_ros.cli.damage import DamageLog
from aick_ros.cli.evaluate import numbers_of
from aick_ros.cli.files import STANDARD_OUTPUT, check_target, write_json
from aick_ros.cli.interruption import Interruption
from aick_ros.errors import InputError
from aick_ros.evaluation.baselines.registry import METHODS, Method, methods_of
from aick_ros.evaluation.benchmark.figures import figure_data, variants
from aick_ros.evaluation.benchmark.journal import Journal
from aick_ros.evaluation.benchmark.recording import Recording, Request
from aick_ros.evaluation.benchmark.results import MethodScore, Results
from aick_ros.evaluation.benchmark.runner import Plan, run

Sources = Annotated[list[str], typer.Argument(
    metavar='SOURCE...', show_default=False, help='Recordings with ground truth, of any kind.')]
Methods = Annotated[str, typer.Option(
    '--methods', metavar='NAME,NAME,...', help=f'all, or some of {", ".join(METHODS)}.')]
Gaps = Annotated[str, typer.Option(
    '--gaps', metavar='N,N,...', help='Distances of the two frames of a pair.')]
Jobs = Annotated[int, typer.Option(
    '--jobs', metavar='N', min=1,
    help='Methods that run at a time. With more than one they disturb each other\'s times.')]
TimeLimit = Annotated[float, typer.Option(
    '--time-limit', metavar='SECONDS', min=0.1,
    help='What takes a method longer, on a frame or a pair, counts as failed.')]
Plots = Annotated[Path | None, typer.Option(
    '--plots', metavar='DIR', show_default=False,
    help="Draw the paper's figures as PNG files; some take runs of their own.")]
Pairs = Annotated[int | None, typer.Option(
    '--pairs', metavar='N', min=1, show_default=False,
    help='At most so many pairs of each gap and source, taken evenly.')]

_TROUBLE = ('crashed', 'took longer', 'given up', 'raised', 'a frame could not be prepared')


def benchmark(sources: Sources, methods: Methods = 'all', gaps: Gaps = '1,2,3,5,8,10,15',
              json: options.JsonFile = None, plots: Plots = None, jobs: Jobs = 1,
              time_limit: TimeLimit = 300.0, pairs: Pairs = None, limit: options.Limit = None,
              max_interval: options.MaxInterval = Request.max_interval) -> int:
    """
    Register the same pairs by AICK and its rivals: success ratios, times, the paper's figures.

    Each method runs in a process of its own, in one thread. One that crashes or hangs stops none
    of the others. Interrupted, the same command with --json FILE goes on where it was.
    """
    chosen, numbers = methods_of(methods), numbers_of(gaps)
    if json is not None:
        check_target(json)
    draw = None if plots is None else _prepare_plots(plots)
    damage = DamageLog()
    recordings = _scan([Request(source, limit, max_interval) for source in sources], damage)
    installed = _installed(chosen)
    plan = Plan(installed, recordings, numbers, pairs, [] if draw is None else variants())
    missing = {method.name: method.missing for method in chosen if method not in installed}
    journal = Journal(_journal_path(json), recordings)
    with Interruption() as interruption:
        unusable = _run(plan, journal, jobs, time_limit, interruption)
    if interruption.requested:
        return _interrupted(journal, json)
    results = Results.of(plan, journal, {**missing, **unusable})
    figures = figure_data(plan, journal)
    if json is not None:
        write_json(json, {'date': datetime.date.today().isoformat(), 'jobs': jobs,
                          'time_limit_s': time_limit, **results.to_json(), 'figures': figures})
    if draw is not None:
        draw(figures, results.recordings, plots)
    journal.delete()
    _show(results, on_stderr=json == STANDARD_OUTPUT)
    damage.close()
    return outcome.UNUSABLE_INPUT if damage.count else outcome.DONE


def _prepare_plots(folder: Path) -> Callable[..., list[Path]]:
    """Find out before a long run whether its figures can be drawn; return what draws them."""
    try:
        from aick_ros.reports.benchmark_plots import write_figures
    except ModuleNotFoundError as error:
        package = (error.name or '').partition('.')[0]
        raise InputError(f"--plots needs {package}: pip install 'aick_ros[eval]'") from None
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f'cannot make the folder {folder}: {error.strerror}') from None
    return write_figures


def _scan(requests: Sequence[Request], damage: DamageLog) -> list[Recording]:
    recordings: dict[str, Recording] = {}
    for request in requests:
        with progress(f'reading {request.path}', request.limit or len(request.open())) as show:
            recording = Recording.scan(request, show, damage)
        if recording.name in recordings:
            raise InputError(f'two sources are called {recording.name}: rename one, or name it '
                             'only once')
        recordings[recording.name] = recording
    return list(recordings.values())


def _installed(methods: Sequence[Method]) -> list[Method]:
    for method in methods:
        if method.missing:
            say(f'{method.name} is left out, it is not installed: {method.missing}')
    installed = [method for method in methods if not method.missing]
    if not installed:
        raise InputError('none of the methods is installed: see the lines above')
    return installed


def _journal_path(json: str | None) -> Path | None:
    if json in (None, STANDARD_OUTPUT):
        return None
    return Path(f'{json}.partial')


def _run(plan: Plan, journal: Journal, jobs: int, time_limit: float,
         interruption: Interruption) -> dict[str, str]:
    if journal.lines_found:
        say('going on where the last run was interrupted')
    try:
        with progress('registering', plan.registrations, 'pairs') as show:
            return run(plan, journal, jobs, time_limit, show, lambda: interruption.requested)
    finally:
        journal.close()


def _interrupted(journal: Journal, json: str | None) -> int:
    if _journal_path(json) is None:
        say('interrupted; nothing is kept, for that name a file with --json')
    else:
        say(f'interrupted; the same command goes on from {_journal_path(json)}')
    return outcome.INTERRUPTED_BY_USER


def _show(results: Results, on_stderr: bool) -> None:
    for recording, facts in results.recordings.items():
        gaps = list(facts['pairs'])
        columns = ('method', 'gap', 'pairs', 'failed', 'within\n3.3 mm', '10 mm', '50 mm',
                   'p50\n[ms]', 'p99\n[ms]', 'a frame\n[ms]')
        rows = (row for method, scores in results.methods.items()
                for row in _rows(method, scores[recording], gaps))
        table(f'{recording}: {facts["frames"]} frames', rows, columns, on_stderr)
    for method, scores in results.methods.items():
        for recording, score in scores.items():
            for failure, count in score.failures.items():
                if failure.startswith(_TROUBLE):
                    say(f'{method} on {recording}: {count} pairs count as failed: {failure}')
    for method, reason in results.not_run.items():
        say(f'{method} was not run: {reason}')


def _rows(method: str, score: MethodScore, gaps: Sequence[str]) -> Iterator[tuple[str, ...]]:
    for gap in gaps:
        pair = score.pairs[gap]
        first = gap == gaps[0]
        yield (method if first else '', gap, str(pair.count), str(pair.failed),
               *(figure(ratio) for ratio in pair.success_ratio.values()),
               figure(pair.registration_ms.p50, digits=2),
               figure(pair.registration_ms.p99, digits=2),
               figure(score.preparation_ms.p50, digits=1) if first else '')
