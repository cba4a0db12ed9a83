# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The benchmark on the terminal, as JSON, and what it says of what it cannot run."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

import psutil
import pytest

from aick_ros.cli.commands import benchmark as benchmark_module
from aick_ros.evaluation.baselines import registry
from aick_ros.evaluation.benchmark.dead_reckoning import walk
from aick_ros.evaluation.benchmark.plan import run_plan
from aick_ros.evaluation.engine.cluster import Cluster, connected
from aick_ros.sources.writers.tum_writer import write_tum


@pytest.fixture(scope='module')
def folder(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp('recordings') / 'rendered'
    write_tum(path, recording)
    return path


@pytest.fixture(scope='module')
def client():
    """Return a connection to a process of this machine."""
    with connected(Cluster(1)) as connection:
        yield connection


@pytest.fixture(autouse=True)
def one_process(client, monkeypatch):
    """Let all runs of the command have the same process."""
    monkeypatch.setattr(benchmark_module, 'connected', lambda cluster: nullcontext(client))


@pytest.fixture
def without_rivals(monkeypatch):
    """Let small_gicp be the only rival, and let it be missing."""
    gicp = dataclasses.replace(registry.METHODS['small-gicp'], needs=(
        registry.Need(lambda: False, 'pip install small_gicp'),))
    fast = registry.METHODS['aick-orb-350']
    monkeypatch.setattr(registry, 'METHODS', {m.name: m for m in (fast, gicp)})


def test_no_more_processes_are_started_than_there_are_runs(aick, client, folder, monkeypatch):
    started = []

    def started_with(cluster):
        started.append(cluster.workers)
        return nullcontext(client)
    monkeypatch.setattr(benchmark_module, 'connected', started_with)
    outcome = aick('benchmark', folder, '--methods', 'aick,aick-orb-350', '--gaps', '1',
                   '--limit', '2', '--jobs', '100000')
    assert (outcome.code, started) == (0, [2])


def test_json_has_the_promised_names(aick, folder, tmp_path):
    outcome = aick('benchmark', folder, '--methods', 'aick,aick-orb-350', '--gaps', '1,20',
                   '--limit', '4', '--json', 'figures.json')
    figures = json.loads((tmp_path / 'figures.json').read_text())
    assert outcome.code == 0
    assert list(figures['methods']) == ['aick', 'aick-orb-350']
    pair = figures['methods']['aick']['rendered']['pairs']['1']
    assert pair['count'] == 3 and pair['failed'] == 0
    assert set(pair) == {'count', 'failed', 'success_ratio', 'translation_median_m',
                         'rotation_median_deg', 'registration_ms', 'consistency'}
    assert figures['methods']['aick']['rendered']['pairs']['20']['count'] == 0
    assert outcome.sentence.startswith('rendered (4 frames) has no pair at --gaps 20: ')
    assert figures['recordings']['rendered']['frames'] == 4
    assert figures['not_run'] == {}
    assert figures['threads'] == 1
    assert figures['machine']['cores'] >= 1
    assert os.listdir() == ['figures.json']
    assert f'{pair["success_ratio"]["0.01"]:.3f}' in outcome.out


def test_what_is_not_installed_is_named(aick, folder, without_rivals):
    outcome = aick('benchmark', folder, '--gaps', '1', '--limit', '3', '--json', '-')
    figures = json.loads(outcome.out)
    assert outcome.code == 0
    assert list(figures['methods']) == ['aick-orb-350']
    assert figures['not_run'] == {'small-gicp': 'pip install small_gicp'}
    assert 'small-gicp is skipped, it is not installed: pip install small_gicp' in outcome.err


def test_figures_come_with_the_walk_along_shelves(aick, folder, without_rivals, monkeypatch):
    monkeypatch.setattr(benchmark_module, 'variants', lambda figures: [])
    outcome = aick('benchmark', folder, '--methods', 'aick-orb-350', '--gaps', '1', '--limit', '3',
                   '--plots', 'made/plots', '--corridor', '3', '--json', '-')
    figures = json.loads(outcome.out)
    assert outcome.code == 0
    assert figures['corridor']['frames'] == 3
    assert list(figures['figures']) == ['9']
    assert sorted(os.listdir('made/plots')) == ['figure-10.png', 'figure-9.png']


def test_interrupted_on_the_walk_it_goes_on_there(aick, folder, without_rivals, monkeypatch):
    command = ['benchmark', folder, '--gaps', '1', '--limit', '3', '--plots', 'plots',
               '--corridor', '2', '--json', 'figures.json']
    monkeypatch.setattr(benchmark_module, 'variants', lambda figures: [])

    def interrupted(frames):
        signal.raise_signal(signal.SIGINT)
        return walk(frames)

    with monkeypatch.context() as patch:
        patch.setattr(benchmark_module, 'walk', interrupted)
        outcome = aick(*command)
    assert outcome.code == 130
    assert os.listdir('plots') == []
    assert aick(*command).code == 0
    assert json.loads(Path('figures.json').read_text())['corridor']['frames'] == 2
    assert not Path('figures.json.partial').exists()


@pytest.mark.parametrize(('arguments', 'sentence'), [
    (['--methods', 'icp'], "no method is called 'icp'"),
    (['--methods', 'small-gicp'], 'none of the methods is installed'),
    (['--gaps', '0'], '--gaps 0'),
    (['--json', 'nowhere/figures.json'], 'the folder nowhere does not exist'),
    (['--limit', '1'], 'at least 2 are required'),
    (['--plots', '/dev/null/plots'], '--plots /dev/null/plots: cannot make the folder'),
    (['again'], 'again does not exist')])
def test_an_impossible_benchmark_is_rejected(aick, folder, without_rivals, arguments, sentence):
    outcome = aick('benchmark', folder, *arguments)
    assert outcome.code == 2
    assert sentence in outcome.err.splitlines()[-1]
    assert os.listdir() == []


def test_a_recording_without_a_pair_is_rejected_before_the_runs(
        aick, folder, without_rivals, monkeypatch):
    monkeypatch.setattr(benchmark_module, 'connected', lambda cluster: pytest.fail('it starts'))
    outcome = aick('benchmark', folder, '--methods', 'aick-orb-350', '--limit', '8', '--gaps',
                   '20,100', '--json', 'figures.json')
    assert (outcome.code, outcome.sentence) == (
        2, 'rendered (8 frames) has no pair at --gaps 20,100: name gaps below 8, or read more '
           'frames')
    assert os.listdir() == []


def test_a_repeated_source_and_one_without_ground_truth_are_rejected(
        aick, folder, tmp_path, in_memory, recording):
    assert 'two recordings are called rendered' in aick('benchmark', folder, folder).sentence
    write_tum(tmp_path / 'blind', in_memory(list(recording.frames(None))[:3]))
    assert 'blind has no ground truth' in aick('benchmark', 'blind').sentence


def interrupted(plan, journal, scratch, client, time_limit, show, is_stopped):
    """Run a plan until its first pairs are done; then there is a Ctrl-C."""
    def show_and_interrupt(done):
        show(done)
        if done and not is_stopped():
            signal.raise_signal(signal.SIGINT)
    return run_plan(plan, journal, scratch, client, time_limit, show_and_interrupt, is_stopped)


def test_an_interrupted_benchmark_resumes(aick, folder, tmp_path, monkeypatch):
    """With processes of its own: those of an interrupted command end with it."""
    monkeypatch.setattr(benchmark_module, 'connected', connected)
    command = ('benchmark', folder, '--methods', 'aick,aick-orb,aick-orb-350', '--gaps', '1,2',
               '--json', 'figures.json')
    with monkeypatch.context() as patch:
        patch.setattr(benchmark_module, 'run_plan', interrupted)
        outcome = aick(*command)
    assert outcome.code == 130
    assert outcome.err.splitlines()[-1] == \
        'aick: interrupted; the same command resumes from figures.json.partial'
    first = (tmp_path / 'figures.json.partial').read_text()
    assert 0 < first.count('"pair"') < 3 * (13 + 12)
    again = aick(*command)
    assert again.code == 0
    assert 'resuming the interrupted run' in again.err
    figures = json.loads((tmp_path / 'figures.json').read_text())
    assert [scores['rendered']['pairs']['2']['count']
            for scores in figures['methods'].values()] == [12, 12, 12]
    assert [path.name for path in tmp_path.iterdir()] == ['figures.json']


@contextmanager
def benchmark_at_work(folder, tmp_path, **options):
    """Start the command, which leads a group of processes, and give it when those are there."""
    command = [sys.executable, '-m', 'aick_ros', 'benchmark', folder, '--methods', 'aick',
               '--gaps', '1', '--json', 'figures.json']
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True,
                          env={**os.environ, 'TMPDIR': str(tmp_path)}, start_new_session=True,
                          **options) as process:
        while not [path for path in tmp_path.iterdir() if path.name.startswith('pymp-')]:
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.01)
        yield process


def living(group):
    """Return the processes of a group that have not ended."""
    found = []
    for process in psutil.process_iter():
        with suppress(ProcessLookupError, psutil.Error):
            if (os.getpgid(process.pid) == group
                    and process.status() != psutil.STATUS_ZOMBIE):
                found.append(process.cmdline())
    return found


@pytest.mark.usefixtures('terminal')
@pytest.mark.parametrize('signalled, ending', [
    (os.kill, signal.SIGTERM), (os.kill, signal.SIGHUP), (os.killpg, signal.SIGHUP)])
def test_a_signal_leaves_no_temporary_files(folder, tmp_path, signalled, ending):
    """The end of a terminal signals the processes of the command too."""
    with benchmark_at_work(folder, tmp_path) as process:
        signalled(process.pid, ending)
        said = process.stderr.read()
    assert process.returncode == 130, said
    assert said == 'aick: interrupted; the same command resumes from figures.json.partial\n'
    assert [path.name for path in tmp_path.iterdir()] == ['figures.json.partial']
    deadline = time.monotonic() + 20
    while left := living(process.pid):
        assert time.monotonic() < deadline, left
        time.sleep(0.05)


def test_after_nohup_it_outlives_its_terminal(folder, tmp_path):
    with benchmark_at_work(folder, tmp_path, preexec_fn=lambda: signal.signal(
            signal.SIGHUP, signal.SIG_IGN)) as process:
        os.killpg(process.pid, signal.SIGHUP)
        said = process.stderr.read()
    assert (process.returncode, said) == (0, '')
    assert [path.name for path in tmp_path.iterdir()] == ['figures.json']
