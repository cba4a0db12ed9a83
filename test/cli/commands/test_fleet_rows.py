# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rows, sentences and means of a fleet whose tasks end as they are told to."""

import re
from contextlib import nullcontext
from pathlib import Path

import pytest
from distributed import Client, LocalCluster

from aick_ros.cli.commands import fleet as module
from aick_ros.cli.fleet import summary
from aick_ros.cli.fleet.job import Finished
from aick_ros.errors import InputError
from aick_ros.evaluation.engine.cluster import Cluster
from aick_ros.evaluation.engine.tasks import Cause, Failure, Outcome
from aick_ros.evaluation.runs.table import read_table

RPE, ATE = 'trajectory.rpe_1s_translation_rmse_m', 'trajectory.ate_rmse_m'
TRACKED = 'trajectory.tracked_fraction'


@pytest.fixture(scope='module')
def client():
    """Return Dask's client of a worker in this process."""
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, protocol='tcp://',
                      host='127.0.0.1', dashboard_address='127.0.0.1:0') as cluster, \
            Client(cluster) as connection:
        yield connection


@pytest.fixture
def fleet(aick, client, monkeypatch, tmp_path):
    """Return a function that runs the command, with what becomes of each of its jobs."""
    def run(ends, *arguments):
        def run_tasks(client, function, jobs, limits, is_stopped, say):
            for job in jobs:
                asked.append((Path(job.source).name, job.variant))
                yield Outcome(job, ends(job), 2, 'tcp://worker:1')

        asked.clear()
        monkeypatch.setattr(module, 'run_tasks', run_tasks)
        monkeypatch.setattr(module, 'connected', lambda cluster: nullcontext(client))
        monkeypatch.setattr(module, 'start_fork_server', lambda modules: None)
        outcome = aick('fleet', *arguments, '--out', 'out')
        return outcome, read_table(tmp_path / 'out' / 'table.parquet')

    asked = run.asked = []
    for name in ('a.bag', 'b.bag'):
        (tmp_path / name).write_text(name)
    return run


def done(job):
    return Finished(Path(job.source).stem, {ATE: 0.25, 'frames': 9}, {'name.txt': b'content'})


def test_a_run_that_is_done_is_a_row_and_a_folder(fleet, client, monkeypatch, tmp_path):
    counts = []
    monkeypatch.setattr(module, 'progress', lambda what, total, unit: (
        counts.append(total) or nullcontext(counts.append)))
    outcome, (row, other) = fleet(done, 'a.bag', '--vary', 'refinement.mode=none,joint',
                                  '--vary', 'aick.iterations=5')
    assert (outcome.code, counts) == (0, [2, 1, 2])
    identity = row.pop('identity')
    assert len(identity) == 32 and identity != other['identity']
    assert row == {
        'recording': 'a', 'source': str(tmp_path / 'a.bag'), 'status': 'done',
        'variant': 'refinement.mode=none,aick.iterations=5', 'set.refinement.mode': 'none',
        'set.aick.iterations': 5, 'cause': '', 'reason': '', 'attempts': 2,
        'worker': 'tcp://worker:1', ATE: 0.25, 'frames': 9,
        'run': 'runs/refinement.mode=none,aick.iterations=5/a.bag'}
    assert (tmp_path / 'out' / row['run'] / 'name.txt').read_text() == 'content'
    assert outcome.err.splitlines() == [
        f'aick: the tasks can be watched at {client.dashboard_link}',
        'aick: details: out/report.html']


@pytest.mark.parametrize('cause', Cause)
def test_only_what_would_fail_again_is_not_tried_again(fleet, cause):
    outcome, (row,) = fleet(lambda job: Failure(cause, 'a reason'), 'a.bag', '--no-dashboard')
    assert (outcome.code, row['status'], row['cause'], row['reason'], row['attempts']) == (
        2, 'failed', cause.value, 'a reason', 2)
    assert row['recording'] == 'a.bag'  # its name is not known
    source = row['source']
    assert outcome.err.splitlines() == [
        f'aick: {source} (settings): {cause.value}: a reason',
        'aick: 1 of 1 runs failed: out/table.parquet has the reasons',
        'aick: details: out/report.html']
    again, _ = fleet(done, 'a.bag', '--no-dashboard')
    assert fleet.asked == ([] if cause is Cause.INPUT else [('a.bag', 'settings')])
    assert ('1 of 1 runs are done already' in again.err) == (cause is Cause.INPUT)


def test_five_failures_are_listed_and_all_are_counted(fleet, tmp_path):
    for number in range(7):
        (tmp_path / f'{number}.bag').touch()
    outcome, rows = fleet(lambda job: Failure(Cause.LOST, 'x') if job.source[-5] in '012345' else
                          done(job), *(f'{number}.bag' for number in range(7)))
    assert sum('process lost: x' in line for line in outcome.err.splitlines()) == 5
    assert '6 of 7 runs failed' in outcome.err


def test_the_table_has_means_over_what_is_known(fleet, monkeypatch):
    figures = {'a.bag': {RPE: 0.01, ATE: 0.5, TRACKED: 1.0}, 'b.bag': {RPE: 0.02, TRACKED: 0.9}}
    shown = []
    monkeypatch.setattr(summary, 'table', lambda title, rows, columns, on_stderr: shown.append(
        (title, [dict(zip(columns, row, strict=True)) for row in rows], on_stderr)))

    def ends(job):
        if job.variant.endswith('7'):
            return Failure(Cause.TIME, 'x')
        return Finished('r', {'frames': 9, **figures[Path(job.source).name]}, {})
    fleet(ends, 'a.bag', 'b.bag', '--vary', 'aick.alpha=0.6,0.7', '--json', '-')
    assert shown == [('runs: 4', [
        {'settings': 'aick.alpha=0.6', 'done': '2', 'failed': '0', 'RPE over 1 s': '0.0150 m',
         'ATE': '0.5000 m', 'tracked': '0.9500'},
        {'settings': 'aick.alpha=0.7', 'done': '0', 'failed': '2', 'RPE over 1 s': '-',
         'ATE': '-', 'tracked': '-'}], True)]


@pytest.mark.parametrize('limit, is_enough', [('400MB', True), ('399.9MB', False), ('auto', True)])
def test_a_process_needs_memory_to_start(limit, is_enough):
    if is_enough:
        assert module._memory(limit) == limit
    else:
        with pytest.raises(InputError) as error:
            module._memory(limit)
        assert str(error.value) == (f'--memory-limit {limit} is too little for a process: 400 MB '
                                    'or more are required')


@pytest.mark.parametrize('scheduler, has_dashboard, is_said', [
    (None, True, True), (None, False, False), ('tcp://x:1', False, True)])
def test_the_pages_of_dask_are_named_where_there_are_some(
        client, capsys, scheduler, has_dashboard, is_said):
    module._name_dashboard(Cluster(1, scheduler=scheduler, has_dashboard=has_dashboard), client)
    assert re.fullmatch(r'http://127\.0\.0\.1:[1-9]\d*/status', client.dashboard_link)
    assert capsys.readouterr().err == (
        f'aick: the tasks can be watched at {client.dashboard_link}\n' if is_said else '')
