# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tasks through crashes, hangs, lost processes and other versions: one outcome each."""

import os
import platform
import re
import signal
import subprocess
import sys
import time
from multiprocessing import resource_tracker

import dask
import distributed
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.engine import cluster as cluster_module
from aick_ros.evaluation.engine.cluster import Cluster, connected
from aick_ros.evaluation.engine.requirements import check_dask
from aick_ros.evaluation.engine.tasks import Cause, Failure, Limits, failure_of, run_tasks
from aick_ros.evaluation.engine.versions import own_versions, reject_other_versions


def run(client, function, arguments, **options):
    """Return argument -> outcome."""
    end = time.monotonic() + 120
    outcomes = list(run_tasks(client, function, arguments,
                              is_stopped=lambda: time.monotonic() > end, **options))
    assert len({outcome.argument for outcome in outcomes}) == len(outcomes) == len(arguments)
    return {outcome.argument: outcome for outcome in outcomes}


@pytest.mark.parametrize('error, cause', [
    (MemoryError(), Cause.MEMORY), (RuntimeError("can't start new thread"), Cause.MEMORY),
    (ImportError('x.so: failed to map segment from shared object'), Cause.MEMORY),
    (RuntimeError('odd'), Cause.DEFECT), (InputError('Insufficient memory'), Cause.INPUT)])
def test_a_limit_to_the_memory_is_no_defect(error, cause):
    assert failure_of(error).cause is cause


@pytest.mark.parametrize('reason, shown', [
    ('too dark', 'too dark'), ('r' * 300, 'r' * 300), ('s' * 400, 's' * 296 + ' ...'),
    ('twelve chars ' * 40, ('twelve chars ' * 40)[:292] + ' ...')])
def test_a_long_reason_ends_with_a_whole_word(reason, shown):
    assert failure_of(InputError(reason)).reason == shown


def test_each_task_has_one_outcome_whatever_the_others_do(client, deeds):
    outcomes = run(client, deeds, [1, 'damaged', 'defect', 'memory', 'exit', 'hang', 2, 3],
                   limits=Limits(seconds=2.0))
    values = {argument: outcome.value for argument, outcome in outcomes.items()}
    assert (values[1], values[2], values[3]) == (2, 4, 6)
    assert values['damaged'] == Failure(Cause.INPUT, 'it is damaged')
    assert values['defect'] == Failure(Cause.DEFECT, 'ZeroDivisionError: division by zero')
    assert values['exit'] == Failure(Cause.DEFECT, 'SystemExit: no licence')
    assert values['memory'].cause is Cause.MEMORY
    assert values['hang'] == Failure(Cause.TIME, 'took longer than 2 s')


def test_a_task_is_tried_again_unless_it_always_dies_or_has_no_memory(client, deeds, tmp_path):
    once = 'once', str(tmp_path / 'flag')
    outcomes = run(client, deeds, [1, 'abort', 'hog', once, 2], limits=Limits(attempts=2))
    assert outcomes['abort'].value == Failure(Cause.LOST, 'crashed or was killed in 2 processes')
    assert outcomes['hog'].value == Failure(Cause.MEMORY, 'used more memory than its process may')
    assert (outcomes['hog'].attempts, outcomes['abort'].attempts) == (1, 2)
    assert (outcomes[once].value, outcomes[once].attempts) == ('second', 2)


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='the allocator of glibc')
def test_a_process_keeps_the_memory_of_its_images(client, deeds):
    faults = run(client, deeds, ['images'])['images'].value
    pages = 3 * 480 * 640 * 4 / 4096  # about as many without
    assert faults < 0.05 * pages


def test_without_dashboard_no_fixed_port_is_taken(client):
    """Nor does Dask then say that another command has it."""
    assert client.scheduler_info()['services']['dashboard'] != 8787


def test_dask_writes_to_a_folder_that_is_removed(client):
    folders = {client.cluster.scheduler.local_directory,
               *client.run(lambda dask_worker: dask_worker.local_directory).values()}
    assert len(folders) > 1
    assert all('/aick-scratch-' in folder for folder in folders)


def test_sigterm_while_processes_start_ends_them_once_they_have(monkeypatch, capfd):
    class Interrupted(distributed.LocalCluster):
        def __init__(self, *arguments, **options):
            signal.raise_signal(signal.SIGTERM)
            super().__init__(*arguments, **options)
            started.append(len(self.workers))

    started = []
    monkeypatch.setattr(distributed, 'LocalCluster', Interrupted)
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), connected(Cluster(1)):
            pytest.fail('it goes on')
        assert signal.getsignal(signal.SIGTERM) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGTERM, before)
    assert started == [1]
    assert capfd.readouterr().err == ''


@pytest.mark.parametrize('error', [RuntimeError('Nanny failed to start.'),
                                   OSError(24, 'Too many open files'),
                                   TypeError('of a setting')])
@pytest.mark.parametrize('is_signalled', [False, True])
def test_processes_that_do_not_start_are_named_unless_a_signal_ended_them(
        monkeypatch, error, is_signalled):
    def fail(**options):
        if is_signalled:
            signal.raise_signal(signal.SIGTERM)
        raise error

    monkeypatch.setattr(distributed, 'LocalCluster', fail)
    before = signal.signal(signal.SIGTERM, lambda number, frame: None)
    try:
        with pytest.raises(KeyboardInterrupt if is_signalled else InputError) as raised:
            with connected(Cluster(2)):
                pytest.fail('it goes on')
    finally:
        signal.signal(signal.SIGTERM, before)
    assert is_signalled or f'2 processes cannot be started ({error})' in str(raised.value)


@pytest.mark.parametrize('allowed', [8, 16, 24, 48])
def test_too_few_open_files_are_one_sentence(allowed):
    command = ('import resource; from aick_ros.evaluation.engine.cluster import *\n'
               'from distributed import Client, LocalCluster\n'
               f'resource.setrlimit(resource.RLIMIT_NOFILE, ({allowed}, {allowed}))\n'
               'try:\n with connected(Cluster(2)): pass\n'
               'except InputError as error: print(error)')
    run = subprocess.run([sys.executable, '-c', command], capture_output=True, text=True)
    assert run.stdout.startswith(f'{allowed} open files are allowed, 2 processes require ')
    assert run.stderr == ''


@pytest.mark.parametrize('setting', [
    'DASK_CONFIG=settings.yaml', 'DASK_DISTRIBUTED__LOGGING=x', 'DASK_DISTRIBUTED__COMM=3',
    'DASK_DISTRIBUTED__SCHEDULER=x'])
def test_settings_that_dask_cannot_read_are_named(tmp_path, setting):
    (tmp_path / 'settings.yaml').write_text('a: [1')
    name, value = setting.split('=')
    command = ('from aick_ros.evaluation.engine.cluster import Cluster, connected\n'
               'from aick_ros.errors import InputError\n'
               'try:\n with connected(Cluster(1)): pass\n'
               'except InputError as error: print(error)')
    run = subprocess.run([sys.executable, '-c', command], cwd=tmp_path, capture_output=True,
                         text=True, env={**os.environ, name: value})
    assert re.match(r'Dask cannot be used \(.*\): correct its settings', run.stdout, re.DOTALL)
    assert run.stderr == ''


@pytest.mark.parametrize('name', ['DASK_CONFIG', 'DASK_ROOT_CONFIG'])
def test_settings_that_never_end_are_rejected_before_they_are_read(monkeypatch, name):
    monkeypatch.setenv(name, '/dev/zero')
    with pytest.raises(InputError, match=f'settings of Dask .{name}. /dev/zero: it is not a'):
        check_dask()


def test_a_temporary_folder_may_be_called_by_a_number(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with dask.config.set({'temporary-directory': 7}), connected(Cluster(1)) as client:
        assert f'{tmp_path}/7/' in client.cluster.scheduler.local_directory


def test_ctrl_c_reaches_no_process_that_starts(monkeypatch):
    """Not even where the resource tracker of multiprocessing, which unblocks it, is new."""
    def started(**options):
        resource_tracker.ensure_running()
        assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) >= {signal.SIGINT, signal.SIGHUP}
        raise RuntimeError('enough')

    monkeypatch.setattr(resource_tracker, 'ensure_running',
                        resource_tracker.ResourceTracker().ensure_running)
    monkeypatch.setattr(distributed, 'LocalCluster', started)
    with pytest.raises(InputError, match='enough'), connected(Cluster(1)):
        pytest.fail('it goes on')


def test_tasks_are_left_when_the_user_stops(client, deeds):
    seen = []
    for outcome in run_tasks(client, deeds, [1, 'sleep'], Limits(seconds=1.0),
                             is_stopped=lambda: bool(seen)):
        seen.append(outcome.value)
    assert seen == [2]


def test_workers_of_other_versions_are_rejected(elsewhere):
    said = []
    with connected(Cluster(1, scheduler=elsewhere.address)) as client:
        reject_other_versions(client, said.append)
        assert said == []
        with pytest.raises(InputError, match='none of the workers can be used'):
            reject_other_versions(client, said.append, {**own_versions(), 'NumPy': '0.9'})
    assert len(said) == 1
    assert 'is rejected: it has other versions: NumPy' in said[0]
    assert said[0].endswith('instead of 0.9')


def test_the_loss_of_the_scheduler_is_a_sentence(elsewhere, deeds):
    def kill():
        elsewhere.process.kill()
        return False
    with connected(Cluster(1, scheduler=elsewhere.address)) as client:
        with pytest.raises(InputError, match='the scheduler was lost'):
            list(run_tasks(client, deeds, ['sleep'], is_stopped=kill))


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    monkeypatch.setattr(cluster_module, '_CONNECTION_LIMIT', 0.2)
    with pytest.raises(InputError, match='tcp://127.0.0.1:9 does not answer'):
        with connected(Cluster(1, scheduler='tcp://127.0.0.1:9')):
            pass
