# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Plans on processes of the engine: crashes and hangs fail their pair, interruptions resume."""

import dataclasses
import json

import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.benchmark.journal import begin
from aick_ros.evaluation.benchmark.plan import Plan, run_plan
from aick_ros.evaluation.benchmark.results import Results
from aick_ros.evaluation.engine.cluster import Cluster, connected

GAPS = (1, 3)


@pytest.fixture(scope='module')
def client(methods):
    """Return a connection to two processes of this machine."""
    with connected(Cluster(2)) as connection:
        yield connection


@pytest.fixture
def execute(client, recording, tmp_path):
    """Return a function that runs a plan; it returns the journal, progress and reasons."""
    def execute(plan, name='journal', time_limit=120.0, is_stopped=lambda progress: False):
        progress = []
        folder = tmp_path / f'run {len(list(tmp_path.iterdir()))}'
        folder.mkdir()
        journal = begin(tmp_path / name, [recording])
        reasons = run_plan(plan, journal, folder, client, time_limit, progress.append,
                           lambda: is_stopped(progress))
        return journal, progress, reasons
    return execute


def without_times(figures):
    """Return the figures that are the same in each run."""
    if not isinstance(figures, dict):
        return figures
    return {key: without_times(value) for key, value in figures.items()
            if not key.endswith('_ms')}


def scores(plan, journal):
    content = Results.of(plan, journal, {}).to_json()['methods']
    return without_times(json.loads(json.dumps(content)))


def test_each_method_has_a_job_for_each_recording_with_a_file_of_its_own(
        recording, aick, method, tmp_path):
    recordings = [recording, dataclasses.replace(recording, name='again')]
    plan = Plan([aick], recordings, GAPS, variants=[method()])
    jobs = plan.jobs(tmp_path / 'journal', tmp_path, 2.0)
    assert {(job.identity, job.recording.name) for job in jobs} == {
        (each.identity, name) for each in (aick, method()) for name in ('rendered', 'again')}
    assert len(jobs) == len({job.last_step for job in jobs}) == plan.most_processes == 4
    assert {job.last_step.parent for job in jobs} == {tmp_path}
    assert sum(len(job.pairs) for job in jobs) == plan.registrations == 4 * (7 + 5)


def test_a_lost_process_fails_its_step_only(recording, aick, method, execute):
    stamps = recording.stamps
    deeds = {'crash': method('crash', [stamps[3]]), 'frame': method('crash', [stamps[4]], 'frame'),
             'hang': method('hang', [stamps[2]]), 'always': method('crash', 'always'),
             'broken': method(factory='misbehaving:breaks_down')}
    plan = Plan([*deeds.values(), aick], [recording], [1])
    journal, _, reasons = execute(plan, time_limit=2.0)
    causes = {name: {pair.source: line.failure for pair, line in journal.pairs[
        deed.identity, 'rendered'].items() if line.failure}
        for name, deed in deeds.items() if name != 'broken'}
    given_up = 'given up: crashed or was killed in 4 processes'
    assert causes == {
        'crash': {3: 'crashed (Aborted)'},
        'frame': {4: 'crashed (Aborted)', 5: 'crashed (Aborted)'},
        'hang': {2: 'took longer than 2 s'},
        'always': {**dict.fromkeys((1, 2, 3), 'crashed (Aborted)'),
                   **dict.fromkeys((4, 5, 6, 7), given_up)}}
    assert reasons == {'still': 'crashed (Aborted) while it was loaded'}
    assert not any(line.failure for line in journal.pairs[aick.identity, 'rendered'].values())
    assert journal.registrations == 5 * 7


@pytest.mark.parametrize('change', [
    lambda stamps: (*stamps[:-1], stamps[-1] + 1), lambda stamps: stamps[1:],
    lambda stamps: stamps[:-1], lambda stamps: (*stamps, stamps[-1] + 1)],
    ids=['other', 'first', 'last', 'more'])
def test_of_a_recording_that_has_changed_no_pair_counts_as_failed(
        recording, method, execute, change):
    before = dataclasses.replace(recording, stamps=change(recording.stamps))
    with pytest.raises(InputError, match='the frames of rendered have changed since the start'):
        execute(Plan([method()], [before], (1,)))


def test_an_interrupted_run_resumes(recording, aick, method, execute, tmp_path):
    plan = Plan([aick, method()], [recording], GAPS)
    whole, progress, _ = execute(plan, 'whole')
    assert progress == sorted(progress)
    first, _, _ = execute(plan, 'first', is_stopped=lambda progress: progress[-1] > 0)
    assert 0 < first.registrations
    # a copy: the process is another test's too, and may still add to the first
    lines = first.path.read_text().splitlines()[:6]
    (tmp_path / 'second').write_text('\n'.join(lines) + '\n{"method": "cut o')
    second, progress, _ = execute(plan, 'second')
    assert 0 < progress[0]
    assert second.registrations == plan.registrations
    assert scores(plan, second) == scores(plan, whole)
