# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick fleet``: many recordings, with one or several settings, on many processes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from aick_ros.borders.names import counted
from aick_ros.cli import exit_codes
from aick_ros.cli.fleet.content import identity_of, state_of
from aick_ros.cli.fleet.job import Finished, Job, run_job
from aick_ros.cli.fleet.recordings import find_recordings
from aick_ros.cli.fleet.results import Key, Results
from aick_ros.cli.fleet.scratch import ScratchSpace, remove_scratch
from aick_ros.cli.fleet.summary import REPORT, is_tracked, show_summary
from aick_ros.cli.fleet.sweep import Variant, variants
from aick_ros.cli.fleet.urls import is_url
from aick_ros.cli.input import options
from aick_ros.cli.input.interruption import Interruption
from aick_ros.cli.output.console import progress, say
from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.cli.output.plot_folder import removed_if_empty
from aick_ros.cli.output.target import STANDARD_OUTPUT, check_target
from aick_ros.errors import InputError, TransferError, installation, package_of
from aick_ros.evaluation.engine.cluster import Cluster, connected
from aick_ros.evaluation.engine.fork_server import start_fork_server
from aick_ros.evaluation.engine.tasks import Failure, Limits, Outcome, failure_of, run_tasks
from aick_ros.evaluation.engine.versions import reject_other_versions
from aick_ros.evaluation.runs.table import DONE, FAILED, VARIED, Row
from aick_ros.sources import SourceOptions

if TYPE_CHECKING:
    from distributed import Client

_TASKS = (run_job.__module__,)  # modules that each process has
_LEAST_MEMORY = 400_000_000  # measured: a process takes half of it before its first frame

Sources = Annotated[list[str] | None, typer.Argument(
    metavar='SOURCE...', show_default=False,
    help='Recordings of any format, patterns of their names, or folders with recordings in them; '
         'also URLs, as s3://BUCKET/FOLDER.')]
Out = Annotated[Path, typer.Option(
    '--out', metavar='DIR',
    help='Folder of the table, the runs and the report. The same command resumes there; another '
         'one replaces table and report.')]
Listed = Annotated[Path | None, typer.Option(
    '--list', metavar='FILE', show_default=False, help='File with more sources, one per line.')]
Vary = Annotated[list[str] | None, typer.Option(
    '--vary', metavar='NAME=VALUE,VALUE,...', show_default=False,
    help='Run with each value of a parameter; if repeated, with every combination.')]
Workers = Annotated[int, typer.Option(
    '--workers', metavar='N', min=1, help='Number of processes, of one thread each.')]
MemoryLimit = Annotated[str, typer.Option(
    '--memory-limit', metavar='BYTES',
    help='Most memory of a process, for example 2GB; auto: an equal share of all.')]
TimeLimit = Annotated[float | None, typer.Option(
    '--time-limit', metavar='SECONDS', min=0.1, show_default=False,
    help='Longest time of a run; beyond it the run counts as failed.')]
Scheduler = Annotated[str | None, typer.Option(
    '--scheduler', metavar='tcp://HOST:PORT', show_default=False,
    help='Scheduler of an existing Dask cluster, in place of processes on this machine.')]
ScratchLimit = Annotated[str, typer.Option(
    '--scratch-limit', metavar='BYTES',
    help='Most bytes that a process copies of recordings at URLs and keeps, for example 50GB.')]
Dashboard = Annotated[bool, typer.Option(
    '--dashboard/--no-dashboard', help="Serve Dask's pages about the tasks, on this machine.")]


def fleet(sources: Sources = None, out: Out = Path('fleet'), listed: Listed = None,
          vary: Vary = None, workers: Workers = os.cpu_count() or 1,
          memory_limit: MemoryLimit = 'auto', time_limit: TimeLimit = None,
          scheduler: Scheduler = None, dashboard: Dashboard = True,
          scratch_limit: ScratchLimit = '10GB', gaps: options.Gaps = '1,5,10',
          preset: options.Preset = None, config: options.Config = None,
          assignments: options.Assignments = None, camera: options.CameraFile = None,
          colour_topic: options.ColourTopic = None, depth_topic: options.DepthTopic = None,
          info_topic: options.InfoTopic = None,
          ground_truth_topic: options.GroundTruthTopic = None,
          max_interval: options.MaxInterval = SourceOptions.max_interval,
          register_depth: options.RegisterDepth = False,
          depth_info_topic: options.DepthInfoTopic = None,
          depth_in_colour: options.DepthInColour = None,
          limit: options.Limit = None, json: options.JsonFile = None) -> int:
    """
    Replay and evaluate many recordings, on this machine or a cluster.

    Writes a table of recordings and settings (table.parquet), the folder of each run, and a
    report. A run that fails is a row with its reason. After Ctrl-C, the same command resumes.
    """
    settings = options.settings_from(preset, config, assignments)
    chosen = variants(settings, vary or ())
    camera = camera and camera.absolute()
    recordings = find_recordings(sources or (), listed)
    check_target(json, *recordings, listed, config, camera, *settings.files)
    source_options = SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval,
        register_depth, depth_info_topic, depth_in_colour)
    scratch = ScratchSpace(limit=options.bytes_from('--scratch-limit', scratch_limit))
    jobs = _jobs(recordings, chosen, source_options, options.gaps_from(gaps), limit, scratch)
    cluster = Cluster(min(workers, len(jobs)), _memory(memory_limit), scheduler, dashboard, _TASKS)
    with removed_if_empty(out / 'runs'):
        fleet_run = _Fleet(Results(out), jobs, chosen)
        page = _prepared_page(scheduler)
        with Interruption() as interruption:
            fleet_run.run(cluster, Limits(time_limit or float('inf')), interruption)
            rows = fleet_run.results.write_table(jobs)
    _report(rows, page(rows), out, json, fleet_run.others)
    return _interrupted(len(jobs) - len(rows)) if interruption.requested else fleet_run.code(rows)


def _jobs(recordings: Sequence[str], chosen: Sequence[Variant], source_options: SourceOptions,
          gaps: Sequence[int], limit: int | None, scratch: ScratchSpace) -> dict[Key, Job]:
    """Return the job of each recording and variant."""
    return {(recording, variant.name): Job(recording, variant.name, variant.settings,
                                           source_options, gaps, limit, scratch)
            for recording in recordings for variant in chosen}


def _memory(limit: str) -> str:
    """
    Return the limit to the memory of a process as Dask reads it.

    :raises InputError: where it is none, or no process could start.
    """
    if limit == 'auto':
        return limit
    if options.bytes_from('--memory-limit', limit) < _LEAST_MEMORY:
        raise InputError(f'--memory-limit {limit} is too little for a process: '
                         f'{_LEAST_MEMORY // 10 ** 6} MB or more are required')
    return limit


def _state_or_error(source: str) -> str | InputError:
    try:
        return state_of(source)
    except InputError as error:
        return error


class _Fleet:
    """Runs what has not been run."""

    def __init__(self, results: Results, jobs: Mapping[Key, Job],
                 chosen: Iterable[Variant]) -> None:
        self.results, self._jobs = results, jobs
        self._variants = {variant.name: variant for variant in chosen}
        self._identities: dict[Key, str] = {}
        self.unasked: dict[str, InputError] = {}  # by source, with runs that are kept

    def run(self, cluster: Cluster, limits: Limits, interruption: Interruption) -> None:
        """Run all jobs whose row is missing, or would be another one now."""
        left = self._left()
        done = len(self._jobs) - len(left)
        kept = len(self._identities) - len(left)  # of sources that could be asked for
        if kept:
            say(f'{kept} of {len(self._jobs)} runs are done already')
        if not left:
            return
        with connected(cluster) as client, progress('running', len(self._jobs), 'runs') as show:
            _name_dashboard(cluster, client)
            reject_other_versions(client, say)
            try:
                for ended in run_tasks(client, run_job, left, limits,
                                       lambda: interruption.requested, say):
                    self._keep(ended)
                    done += 1
                    show(done)
            finally:
                _remove_copies(client, left)

    @property
    def others(self) -> int:
        """Number of runs in the folder that are not of this command."""
        return len(self.results.rows.keys() - self._jobs.keys())

    def code(self, rows: Sequence[Row]) -> int:
        """Return the exit code of a fleet with these rows, which was not interrupted."""
        is_whole = not self.unasked and all(map(is_tracked, rows))
        return exit_codes.DONE if is_whole else exit_codes.UNUSABLE_INPUT

    def _left(self) -> list[Job]:
        left = []
        states = {source: _state_or_error(source)  # once for all settings
                  for source in dict.fromkeys(job.source for job in self._jobs.values())}
        for key, job in self._jobs.items():
            state = states[job.source]
            if isinstance(state, InputError):
                self._give_up(key, state)
                continue
            self._identities[key] = identity_of(job, state)
            if not self.results.has(key, self._identities[key]):
                left.append(job)
        if self.unasked:
            say(f'{next(iter(self.unasked.values()))}: the runs that are done are kept '
                f'(recordings that could not be asked for: {len(self.unasked)})')
        return left

    def _give_up(self, key: Key, error: InputError) -> None:
        """Write a failure, unless a run is there whose recording may be unchanged."""
        if isinstance(error, TransferError) and self.results.is_done(key):
            self.unasked[key[0]] = error
        else:
            self.results.add(key, self._row(key, FAILED, _facts(failure_of(error))))

    def _keep(self, ended: Outcome[Job, Finished]) -> None:
        key = ended.argument.source, ended.argument.variant
        facts: Row = {'attempts': ended.attempts, 'worker': ended.worker}
        if isinstance(ended.value, Failure):
            self.results.add(key, {
                **self._row(key, FAILED, _facts(ended.value)), **facts,
                'identity': self._identities[key] if ended.value.cause.is_of_the_input else ''})
        else:
            finished = ended.value
            self.results.add(key, {
                **self._row(key, DONE, {'recording': finished.recording}), **facts,
                **finished.figures}, finished.files)

    def _row(self, key: Key, status: str, facts: Row) -> Row:
        """Return the cells that every row has, and some more."""
        source, variant = key
        varied = {f'{VARIED}{name}': value if isinstance(value, (int, float)) else str(value)
                  for name, value in self._variants[variant].varied.items()}
        return {'recording': os.path.basename(source.rstrip('/')), 'source': source,
                'variant': variant, **varied, 'status': status, 'cause': '', 'reason': '',
                'identity': self._identities.get(key, ''), **facts}


def _report(rows: Sequence[Row], page: str, out: Path, json: str | None, others: int) -> None:
    """Write the page and the JSON, show the scores, and say how many other runs are there."""
    write_whole(out / REPORT, page)
    if json is not None:
        write_json(json, rows)
    show_summary(rows, out, on_stderr=json == STANDARD_OUTPUT)
    if others:
        say(f'{counted(others, "run")} of other commands {"is" if others == 1 else "are"} kept in '
            f'{out / "runs"}, and not in the table')


def _interrupted(left: int) -> int:
    are = 'run is' if left == 1 else 'runs are'
    say(f'interrupted; {left} {are} left, the same command resumes')
    return exit_codes.INTERRUPTED_BY_USER


def _facts(failure: Failure) -> Row:
    return {'cause': failure.cause.value, 'reason': failure.reason}


def _prepared_page(scheduler: str | None) -> Callable[[Sequence[Row]], str]:
    """
    Let processes of this machine import what they need, and meanwhile import the page.

    :returns: what makes it.
    :raises InputError: where matplotlib is missing, before a long run.
    """
    if scheduler is None:
        start_fork_server(_TASKS)
    try:
        from aick_ros.reports.fleet_page import fleet_page
    except ModuleNotFoundError as error:
        raise InputError(f"no page without {package_of(error)}: {installation('eval')}") from None
    return fleet_page


def _remove_copies(client: Client, jobs: Sequence[Job]) -> None:
    """Remove what workers have copied; without a scheduler it stays until they end."""
    if client.status == 'running' and any(is_url(job.source) for job in jobs):
        with suppress(OSError):  # the scheduler was lost meanwhile
            client.run(remove_scratch, jobs[0].scratch.fleet, on_error='ignore')


def _name_dashboard(cluster: Cluster, client: Client) -> None:
    if cluster.scheduler is not None or cluster.has_dashboard:
        say(f'the tasks can be watched at {client.dashboard_link}')
