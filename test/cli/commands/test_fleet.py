# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fleets: figures as of ``aick evaluate``, failures as rows, nothing run twice."""

import json
import logging
import os
import shutil
import sys
import tempfile
from pathlib import Path

import cv2
import distributed
import numpy as np
import pytest
from distributed import Client

from aick_ros.cli.commands import fleet as fleet_module
from aick_ros.cli.fleet import attempts
from aick_ros.cli.fleet.job import Job, run_job
from aick_ros.cli.fleet.results import Results
from aick_ros.cli.fleet.scratch import scratch_of
from aick_ros.errors import InputError, TransferError
from aick_ros.evaluation.engine.cluster import Cluster, connected
from aick_ros.evaluation.runs.run import read_run
from aick_ros.evaluation.runs.table import read_table
from aick_ros.settings import Settings
from aick_ros.sources.writers.tum_writer import write_tum


@pytest.fixture(scope='module')
def scheduler():
    """Return the address of a cluster of one process."""
    with connected(Cluster(1)) as client:
        yield client.scheduler.address


@pytest.fixture(scope='module')
def recordings(recording, tmp_path_factory):
    """Return a folder with a recording in a folder of its own, and a damaged one."""
    folder = tmp_path_factory.mktemp('recordings')
    write_tum(folder / 'monday' / 'rendered', recording)
    (folder / 'damaged').mkdir()
    (folder / 'damaged' / 'rgb.txt').write_text('1.0 rgb/1.png\n')
    return folder


@pytest.fixture
def fleet(aick, scheduler, recordings, tmp_path):
    """Return a function that runs the command and returns its outcome and rows."""
    def run(*arguments):
        outcome = aick('fleet', recordings, '--out', 'out', '--scheduler', scheduler,
                       '--gaps', '1', *arguments)
        return outcome, read_table(tmp_path / 'out' / 'table.parquet')
    return run


def flat(content, name=''):
    """Return the dotted names of numbers and texts, without times."""
    if not isinstance(content, dict):
        return {} if '_ms' in name else {name[1:]: content}
    return {path: value for key, inner in content.items()
            for path, value in flat(inner, f'{name}.{key}').items()}


def test_figures_are_those_of_evaluate_and_failures_are_rows(fleet, aick, recordings, tmp_path):
    vary = ('--vary', 'refinement.mode=none,joint', '--limit', '6')
    outcome, rows = fleet(*vary, '--json', 'rows.json')
    assert outcome.code == 2
    assert [(row['recording'], row['set.refinement.mode'], row['status']) for row in rows] == [
        ('damaged', 'none', 'failed'), ('damaged', 'joint', 'failed'),
        ('rendered', 'none', 'done'), ('rendered', 'joint', 'done')]
    assert 'damaged/depth.txt: No such file' in rows[0]['reason']
    assert '2 of 4 runs failed' in outcome.err
    assert len(json.loads((tmp_path / 'rows.json').read_text())) == 4
    for row in rows[2:]:
        evaluated = json.loads(aick(
            'evaluate', recordings / 'monday' / 'rendered', '--gaps', '1', '--limit', '6', '--set',
            f'refinement.mode={row["set.refinement.mode"]}', '--json', '-').out)
        for key in ('source', 'settings', 'machine', 'ended'):
            del evaluated[key]
        expected = flat(evaluated)
        assert len(expected) > 50
        assert {name: row[name] for name in expected} == expected
        run = read_run(tmp_path / 'out' / row['run'])
        assert (run.source, len(run.records)) == ('rendered', 6)
        assert run.settings['refinement.mode'] == row['set.refinement.mode']
    page = (tmp_path / 'out' / 'report.html').read_text()
    assert 'damaged/depth.txt: No such file' in page


def test_what_is_unchanged_is_not_run_again(fleet, aick, recordings, scheduler, tmp_path):
    shutil.copytree(recordings / 'monday', tmp_path / 'more')
    shutil.copytree(recordings / 'monday' / 'rendered', tmp_path / 'more' / 'b')

    def table(*arguments):
        outcome = aick('fleet', 'more', '--out', 'out', '--scheduler', scheduler, '--gaps', '1',
                       '--limit', '3', *arguments)
        rows = read_table(Path('out', 'table.parquet'))
        return outcome, {os.path.relpath(row['source']): row for row in rows}
    first, before = table()
    assert (first.code, sorted(before)) == (0, ['more/b', 'more/rendered'])
    second, again = table()
    assert again == before
    assert 'aick: 2 of 2 runs are done already' in second.err
    os.utime('more/b/rgb.txt')
    third, after = table()
    assert '1 of 2 runs are done already' in third.err
    assert after['more/rendered'] == before['more/rendered']
    assert after['more/b']['wall_time_s'] != before['more/b']['wall_time_s']
    (tmp_path / 'out' / after['more/rendered']['run'] / 'row.json').unlink()  # as after a kill
    fourth, last = table()
    assert '1 of 2 runs are done already' in fourth.err
    assert last['more/b'] == after['more/b']
    fifth, _ = table('--set', 'aick.alpha=0.7')
    assert 'done already' not in fifth.err


def test_another_command_in_the_folder_keeps_other_runs_and_says_so(
        aick, recordings, scheduler, tmp_path):
    """It replaces the table, and runs of the same name of settings; the first command resumes."""
    def run(*arguments):
        outcome = aick('fleet', recordings / 'monday', '--out', 'out', '--scheduler', scheduler,
                       '--gaps', '1', '--limit', '2', *arguments)
        return outcome, [row['variant'] for row in read_table(tmp_path / 'out' / 'table.parquet')]
    kept = 'of other commands {} kept in out/runs, and not in the table'
    first, both = '--vary=aick.alpha=0.6,0.7', ['aick.alpha=0.6', 'aick.alpha=0.7']
    outcome, variants = run(first)
    assert variants == both and 'other commands' not in outcome.err
    outcome, variants = run()
    assert variants == ['settings'] and f'aick: 2 runs {kept.format("are")}\n' in outcome.err
    outcome, variants = run(first)
    assert variants == both and '2 of 2 runs are done already' in outcome.err
    assert f'aick: 1 run {kept.format("is")}\n' in outcome.err
    assert 'done already' not in run('--set', 'aick.alpha=0.7')[0].err
    assert 'done already' not in run()[0].err  # both have the name 'settings'


def test_an_interrupted_fleet_keeps_what_is_done(fleet, monkeypatch):
    class Interrupted(fleet_module.Interruption):
        def __enter__(self):
            self.requested = True
            return self

        def __exit__(self, *_):
            pass

    with monkeypatch.context() as patch:
        patch.setattr(fleet_module, 'Interruption', Interrupted)
        outcome, rows = fleet('--limit', '2')
    assert outcome.code == 130
    assert rows == []
    assert 'interrupted; 2 runs are left, the same command resumes' in outcome.err
    assert len(fleet('--limit', '2')[1]) == 2


@pytest.mark.parametrize('left, words', [(1, '1 run is left'), (3, '3 runs are left')])
def test_what_is_left_is_counted(capfd, left, words):
    assert fleet_module._interrupted(left) == 130
    assert capfd.readouterr().err == (
        f'aick: interrupted; {words}, the same command resumes\n')


def test_depth_is_registered_in_the_processes_too(aick, scheduler, recordings, tmp_path):
    """Two cameras a hand apart: the figures are those of ``aick evaluate``, and of no other."""
    assert aick('convert', recordings / 'monday' / 'rendered', 'bag', '--limit', 4).code == 0
    common = ('bag', '--gaps', '1')
    registered = ('--register-depth', '--depth-info-topic', '/camera/rgb/camera_info',
                  '--depth-in-colour', 0.1, 0, 0, 0, 0, 0, 1)
    found, expected = [], []
    for out, options in (('plain', ()), ('registered', registered)):
        assert aick('fleet', *common, '--out', out, '--scheduler', scheduler, *options).code == 0
        [row] = read_table(tmp_path / out / 'table.parquet')
        found.append(row['pairs.1.translation_median_m'])
        figures = json.loads(aick('evaluate', *common, *options, '--json', '-').out)
        expected.append(figures['pairs']['1']['translation_median_m'])
    assert found == expected
    assert found[0] != found[1]


def test_a_mask_by_a_relative_path_is_that_of_the_folder_of_the_command(
        aick, scheduler, recordings, tmp_path):
    """Whatever folder a process works in; another image there is another run."""
    monday = recordings / 'monday'

    def run(*arguments):
        return aick(*arguments, '--gaps', '1', '--limit', '4', '--set', 'sensor.mask=mask.png')

    def row(mask):
        cv2.imwrite('mask.png', mask)
        outcome = run('fleet', monday, '--out', 'out', '--scheduler', scheduler)
        assert outcome.code == 0
        return read_table(tmp_path / 'out' / 'table.parquet')[0], outcome

    mask = np.full((240, 320), 255, np.uint8)
    mask[120:] = 0
    found, _ = row(mask)
    expected = json.loads(run('evaluate', monday / 'rendered', '--json', '-').out)
    assert found['trajectory.ate_rmse_m'] == expected['trajectory']['ate_rmse_m']
    assert json.loads((tmp_path / 'out' / 'runs' / 'settings' / 'rendered' / 'summary.json')
                      .read_text())['settings']['sensor.mask'] == f'{tmp_path}/mask.png'
    again, outcome = row(np.full((240, 320), 255, np.uint8))
    assert 'done already' not in outcome.err
    assert again['trajectory.ate_rmse_m'] != found['trajectory.ate_rmse_m']


def test_runs_of_a_table_are_compared(fleet, aick):
    fleet('--limit', '5')
    outcome = aick('compare', 'out', 'out/table.parquet', '--json', '-', '--fail-on-regression')
    assert outcome.code == 0
    assert list(json.loads(outcome.out)['candidates']['out/table.parquet']['recordings']) == [
        'rendered']
    fleet('--limit', '5', '--vary', 'aick.alpha=0.6,0.7')
    assert 'has runs with several settings' in aick('compare', 'out', 'out').sentence
    assert aick('compare', 'out/runs/aick.alpha=0.6', 'out/runs/aick.alpha=0.7').code == 0


@pytest.mark.parametrize(('arguments', 'sentence'), [
    ([], 'no recording is given'),
    (['nowhere'], 'nowhere does not exist'),
    (['synthetic:1', '--vary', 'aick.alpha'], 'NAME=VALUE,VALUE is required'),
    (['synthetic:1', '--vary', 'aick.alpha=0.5', '--vary', 'aick.alpha=0.6'], 'twice'),
    (['synthetic:1', '--vary', 'no.such=1'], "no parameter is called 'no.such'"),
    (['synthetic:1', '--list', 'none.txt'], 'none.txt'),
    (['synthetic:1', '--memory-limit', '1,2'], '--memory-limit 1,2 is no number of bytes'),
    (['synthetic:1', '--memory-limit', '10MB'], '--memory-limit 10MB is too little'),
    (['ftp://127.0.0.1:1/x.bag'], 'cannot read ftp://127.0.0.1:1/x.bag: '),
    (['zip://x.bag::file:///none.zip'], 'zip://x.bag::file:///none.zip cannot be read: archives'),
    (['reference://x.bag'], 'reference://x.bag cannot be read: its kind needs more than a URL')])
def test_an_impossible_fleet_is_rejected(aick, arguments, sentence):
    outcome = aick('fleet', *arguments)
    assert outcome.code == 2
    assert sentence in outcome.sentence
    assert os.listdir() == []


def test_a_page_that_cannot_be_made_is_said_before_the_runs(aick, monkeypatch):
    for name in [name for name in sys.modules
                 if name.startswith(('matplotlib', 'aick_ros.reports'))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, 'matplotlib', None)
    outcome = aick('fleet', 'synthetic:1')
    assert outcome.code == 2
    assert outcome.sentence.startswith("no page without matplotlib: pip install '.[eval]'")
    assert os.listdir() == []


def test_results_that_cannot_be_written_start_no_process(aick, tmp_path, monkeypatch):
    (tmp_path / 'file').write_text('')
    monkeypatch.setattr('aick_ros.cli.commands.fleet.start_fork_server',
                        lambda modules: pytest.fail('a process is started'))
    outcome = aick('fleet', 'synthetic:1', '--out', 'file')
    assert outcome.code == 2
    assert outcome.sentence == (
        '--out file: cannot make the folder: File exists; name another folder')


def test_no_more_processes_are_started_than_there_are_runs(aick, monkeypatch):
    started = []

    def connected(cluster):
        started.append(cluster.workers)
        raise InputError('enough is known')
    monkeypatch.setattr('aick_ros.cli.commands.fleet.connected', connected)
    assert aick('fleet', 'synthetic:1', 'synthetic:2', '--workers', '100000').code == 2
    assert started == [2]


def test_results_do_not_replace_an_input(aick, recordings, tmp_path):
    listed = tmp_path / 'list.txt'
    listed.write_text(f'{recordings}\n')
    metadata = next(recordings.rglob('rgb.txt'))
    before = metadata.read_bytes()
    for target in (listed, metadata):
        outcome = aick('fleet', '--list', listed, '--json', target)
        assert outcome.code == 2
        assert outcome.sentence.startswith(f'cannot write {target}: it is ')
    assert metadata.read_bytes() == before


def test_dask_is_silent_and_its_logging_is_as_before(fleet):
    outcome, _ = fleet('--limit', '2')
    assert 'distributed' not in outcome.err
    assert not any(isinstance(handler, logging.StreamHandler)
                   for handler in logging.getLogger('distributed.nanny').handlers)


def test_a_server_that_is_away_costs_no_run_that_is_done(aick, tmp_path, monkeypatch):
    source, asked = 'file:///away/a.mcap', []
    Results(tmp_path / 'out').add(
        (source, 'aick.alpha=0.6'), {'source': source, 'variant': 'aick.alpha=0.6',
                                     'recording': 'a.mcap', 'status': 'done', 'identity': 'x',
                                     'frames': 9, 'tracked': 9, 'wall_time_s': 9.0},
        {'trajectory.tum': b'hours of work'})

    def state_of(source):
        asked.append(source)
        raise TransferError(f'cannot read {source}: 503')
    monkeypatch.setattr(fleet_module, 'state_of', state_of)
    outcome = aick('fleet', source, '--out', 'out', '--vary', 'aick.alpha=0.6,0.7')
    assert outcome.code == 2
    kept, failed = read_table(tmp_path / 'out' / 'table.parquet')
    assert (kept['status'], failed['status'], failed['cause']) == ('done', 'failed', 'transfer')
    assert (tmp_path / 'out' / kept['run'] / 'trajectory.tum').read_bytes() == b'hours of work'
    assert outcome.err.count(f'cannot read {source}: 503: the runs that are done are kept') == 1
    assert 'done already' not in outcome.err
    assert asked == [source]
    assert aick('fleet', source, '--out', 'out', '--vary', 'aick.alpha=0.6').code == 2


def test_a_run_is_written_in_the_folder_of_its_worker(scheduler, recordings, tmp_path):
    """The system's folder of temporary files may be small, or in memory."""
    def run(job):
        tempfile.tempdir = str(tmp_path / 'full')  # there is no such folder
        try:
            folder = distributed.get_worker().local_directory
            return os.listdir(folder), run_job(job), os.listdir(folder)
        finally:
            tempfile.tempdir = None

    with Client(scheduler) as client:
        before, finished, after = client.submit(run, Job(
            str(recordings / 'monday' / 'rendered'), 'settings', Settings(), gaps=[1],
            limit=2)).result()
    assert 'summary.json' in finished.files
    assert after == before


def test_copies_are_removed_after_an_error_too(aick, scheduler, tmp_path, monkeypatch):
    (tmp_path / 'a.bag').write_text('content')
    copies = []

    def copy(job):
        with scratch_of(job.scratch).copy_of(job.source) as copied:
            return copied.path

    def run_tasks(client, function, jobs, *_):
        copies.append(client.submit(copy, jobs[0]).result())
        assert copies[0].read_text() == 'content'
        raise InputError('the disk is full')
    monkeypatch.setattr(fleet_module, 'run_tasks', run_tasks)
    outcome = aick('fleet', f'file://{tmp_path}/a.bag', '--scheduler', scheduler)
    assert outcome.err.endswith('the disk is full\n')
    assert [path.exists() for path in copies] == [False]


def test_recordings_at_urls_are_copied_run_and_removed(aick, scheduler, recordings, tmp_path,
                                                       monkeypatch):
    """Their figures are those of the folder that they are copies of."""
    monkeypatch.setattr(attempts, '_PAUSE', 0.0)
    pytest.importorskip('aiohttp', reason="no URLs: pip install '.[fleet]'")
    source = f'file://{recordings / "monday"}'
    folder = recordings / 'monday' / 'rendered'
    arguments = ('--scheduler', scheduler, '--limit', '3', '--gaps', '1')
    outcome = aick('fleet', source, 'http://127.0.0.1:9/none.mcap', '--out', 'copied', *arguments,
                   '--vary', 'aick.alpha=0.6,0.7')
    assert outcome.code == 2
    rows = read_table(tmp_path / 'copied' / 'table.parquet')
    assert [(row['source'], row['status'], row['cause']) for row in rows] == [
        *[(f'{source}/rendered', 'done', '')] * 2,
        *[('http://127.0.0.1:9/none.mcap', 'failed', 'transfer')] * 2]
    assert 'Cannot connect to host 127.0.0.1:9' in rows[2]['reason']
    size = sum(path.stat().st_size for path in folder.rglob('*') if path.is_file())
    assert [row['bytes_copied'] for row in rows[:2]] == [size, 0]
    assert aick('fleet', folder, '--out', 'read', *arguments, '--set', 'aick.alpha=0.7').code == 0
    [read] = read_table(tmp_path / 'read' / 'table.parquet')
    assert rows[1]['trajectory.ate_rmse_m'] == read['trajectory.ate_rmse_m']
    assert rows[1]['recording'] == read['recording'] == 'rendered'
    assert read.get('bytes_copied') is None
    with Client(scheduler) as client:
        for worker in client.scheduler_info()['workers'].values():
            assert list(Path(worker['local_directory']).glob('aick-*')) == []
