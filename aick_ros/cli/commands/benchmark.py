# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick benchmark``: compares methods on the same pairs of frames."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from aick_ros.cli import exit_codes, outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.input.interruption import Interruption
from aick_ros.cli.output.benchmark_plots import FigureFolder
from aick_ros.cli.output.benchmark_table import show_results
from aick_ros.cli.output.console import progress, say
from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.cli.output.missing_pairs import without_pairs
from aick_ros.cli.output.target import STANDARD_OUTPUT, check_target
from aick_ros.errors import InputError
from aick_ros.evaluation.baselines.registry import METHODS, Method, make, methods_of
from aick_ros.evaluation.benchmark.dead_reckoning import Reckoning, reckon, walk
from aick_ros.evaluation.benchmark.figures import figure_data, paper_figures, variants
from aick_ros.evaluation.benchmark.journal import Journal, begin, reserved
from aick_ros.evaluation.benchmark.plan import Plan, run_plan
from aick_ros.evaluation.benchmark.recording import Recording, Request
from aick_ros.evaluation.benchmark.results import Results
from aick_ros.evaluation.benchmark.vocabularies import (
    TRAINING_FRAMES, file_name, learn, missing_from, training_frames)
from aick_ros.evaluation.engine.cluster import Cluster, connected
from aick_ros.evaluation.engine.scratch_folder import scratch_folder
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.sources import RgbdSource, raise_damage

Sources = Annotated[list[str], typer.Argument(
    metavar='SOURCE...', show_default=False, help='Recordings with ground truth, of any format.')]
Methods = Annotated[str, typer.Option(
    '--methods', metavar='NAME,NAME,...',
    help=f'Methods to compare: all, or some of {", ".join(METHODS)}.')]
Jobs = Annotated[int, typer.Option(
    '--jobs', metavar='N', min=1,
    help='Number of methods that run at a time. More than one distorts the measured times.')]
TimeLimit = Annotated[float, typer.Option(
    '--time-limit', metavar='SECONDS', min=0.1,
    help='Longest time for a frame or a pair; beyond it the method counts as failed there.')]
Plots = Annotated[Path | None, typer.Option(
    '--plots', metavar='DIR', show_default=False,
    help='Folder for the figures of the paper as PNG files; some of them need additional runs.')]
Corridor = Annotated[int, typer.Option(
    '--corridor', metavar='N', min=0,
    help='Number of frames of the rendered walk for Figure 10 (with --plots); 0: no walk.')]
Pairs = Annotated[int | None, typer.Option(
    '--pairs', metavar='N', min=1, show_default=False,
    help='Maximum number of pairs per gap and recording, evenly spaced. Default: all.')]

Mask = Annotated[Path | None, typer.Option(
    '--mask', metavar='FILE', show_default=False,
    help='Image that hides a part of the images from all methods, as sensor.mask does from AICK.')]


def benchmark(sources: Sources, methods: Methods = 'all', gaps: options.Gaps = '1,2,3,5,8,10,15',
              json: options.JsonFile = None, plots: Plots = None, corridor: Corridor = 1000,
              jobs: Jobs = 1, time_limit: TimeLimit = 300.0, pairs: Pairs = None,
              limit: options.Limit = None, mask: Mask = None,
              max_interval: options.MaxInterval = Request.max_interval,
              register_depth: options.RegisterDepth = False,
              depth_info_topic: options.DepthInfoTopic = None,
              depth_in_colour: options.DepthInColour = None) -> int:
    """
    Compare AICK and other methods on the same pairs of frames: success ratios and times.

    Methods run in processes of one thread; a crash or hang does not affect the other methods.
    After an interruption, the same command with --json FILE resumes the run.
    """
    chosen, numbers = methods_of(methods), options.gaps_from(gaps)
    check_target(json, *sources, mask)
    folder = None if plots is None else FigureFolder(plots)
    damage = DamageLog()
    recordings = _scan([Request(source, limit, max_interval, register_depth, depth_info_topic,
                                depth_in_colour, str(mask or '')) for source in sources], damage)
    installed = _installed(chosen)
    figures = paper_figures(None if folder is None else folder.vocabularies)
    plan = Plan(installed, recordings, numbers, pairs, [] if folder is None else variants(figures))
    missing = {method.name: method.missing for method in chosen if method not in installed}
    _require_pairs(plan)
    _learn_vocabularies(folder, plan)
    with scratch_folder() as scratch, reserved(path := _journal_path(json, scratch)):
        with Interruption() as interruption:
            journal = begin(path, recordings)
            unusable = _run(plan, journal, scratch, jobs, time_limit, interruption)
            wanted = folder is not None and corridor and not interruption.requested
            reckoning = _reckon(corridor, interruption) if wanted else None
        if interruption.requested:
            return _interrupted(json)
        results = Results.of(plan, journal, {**missing, **unusable})
        curves = figure_data(figures, plan, journal)
        _write(json, folder, jobs, time_limit, results, curves, reckoning)
        path.unlink(missing_ok=True)
    show_results(results, on_stderr=json == STANDARD_OUTPUT)
    return outcome.of_damage(damage)


def _scan(requests: Sequence[Request], damage: DamageLog) -> list[Recording]:
    recordings: dict[str, Recording] = {}
    for request in requests:
        total = request.limit or len(request.open())
        with progress(f'reading {request.path}', total) as show:
            recording = Recording.scan(request, show, damage)
        if recording.name in recordings:
            raise InputError(f'two recordings are called {recording.name}: rename one of them, or '
                             'give it only once')
        recordings[recording.name] = recording
    return list(recordings.values())


def _installed(methods: Sequence[Method]) -> list[Method]:
    for method in methods:
        if method.missing:
            say(f'{method.name} is skipped, it is not installed: {method.missing}')
    installed = [method for method in methods if not method.missing]
    if not installed:
        raise InputError('none of the methods is installed: install one as the lines above say')
    return installed


def _require_pairs(plan: Plan) -> None:
    """
    Check that each recording has a pair.

    :raises InputError: naming one that has none at any gap.
    """
    for recording in plan.recordings:
        if not plan.pairs[recording.name]:
            raise InputError(without_pairs(recording.name, len(recording.stamps), plan.gaps))


def _learn_vocabularies(figures: FigureFolder | None, plan: Plan) -> None:
    """Learn vocabularies that figures lack; the next run with the same --plots finds them."""
    if figures is None or not plan.variants:
        return
    folder = figures.vocabularies
    wanted = missing_from(folder)
    if not wanted:
        return
    folder.mkdir(exist_ok=True)
    with progress('learning vocabularies', TRAINING_FRAMES + len(wanted), 'steps') as show:
        for which, vocabulary in learn(wanted, training_frames(), show):
            write_whole(folder / file_name(which), vocabulary.to_bytes())


def _journal_path(json: str | None, scratch: Path) -> Path:
    """Return the path of the journal; without a file to be written it is of no use later."""
    if json in (None, STANDARD_OUTPUT):
        return scratch / 'journal'
    return Path(f'{json}.partial')


def _run(plan: Plan, journal: Journal, scratch: Path, jobs: int, time_limit: float,
         interruption: Interruption) -> dict[str, str]:
    if journal.registrations:
        say('resuming the interrupted run')
    with connected(Cluster(min(jobs, plan.most_processes))) as client, progress(
            'registering', plan.registrations, 'pairs') as show:
        return run_plan(plan, journal, scratch, client, time_limit, show,
                        lambda: interruption.requested)


def _reckon(frames: int, interruption: Interruption) -> Reckoning:
    """Estimate the path along the shelves, until Ctrl-C."""
    source, method = walk(frames), METHODS['aick']
    with progress('walking along shelves', frames) as show:
        return reckon(make(method.factory, method.options), _frames(source, interruption),
                      source.ground_truth, show)


def _frames(source: RgbdSource, interruption: Interruption) -> Iterator[RgbdFrame]:
    """Yield frames, at least one, until Ctrl-C."""
    for frame in source.frames(raise_damage):
        yield frame
        if interruption.requested:
            return


def _write(json: str | None, figures: FigureFolder | None, jobs: int, time_limit: float,
           results: Results, curves: Mapping[str, Any], reckoning: Reckoning | None) -> None:
    """Write what is asked for: the JSON, with the options of the run, and the figures."""
    if json is not None:
        write_json(json, {'jobs': jobs, 'time_limit_s': time_limit,
                          **_content(results, curves, reckoning)})
    if figures is not None:
        figures.write(curves, results.recordings, reckoning)


def _content(results: Results, curves: Mapping[str, Any],
             reckoning: Reckoning | None) -> dict[str, Any]:
    """Return the content of the JSON, without the options of the command."""
    return {'date': datetime.date.today().isoformat(), **results.to_json(), 'figures': curves,
            'corridor': None if reckoning is None else reckoning.end.to_json()}


def _interrupted(json: str | None) -> int:
    if json in (None, STANDARD_OUTPUT):
        say('interrupted; nothing is kept: give --json FILE to be able to resume a run')
    else:
        say(f'interrupted; the same command resumes from {json}.partial')
    return exit_codes.INTERRUPTED_BY_USER
