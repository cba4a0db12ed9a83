# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Methods on the pairs of a recording: errors, failures, and what a lost process left."""

import json
import math

import numpy as np
import pytest

from aick_ros.evaluation.benchmark.journal import begin
from aick_ros.evaluation.benchmark.measurement import Job, measure
from aick_ros.geometry import se3


@pytest.fixture
def measured(recording, tmp_path):
    """Return a function that measures; it returns the lines by pair, frames, and the reason."""
    def run(method, gaps=(1,), last_step=''):
        (tmp_path / 'last_step').write_text(last_step)
        journal = begin(tmp_path / 'journal', [recording])
        reason = measure(Job(method.identity, method.factory, method.options, recording,
                             recording.pairs(gaps), journal.path, tmp_path / 'last_step',
                             math.inf))
        journal.refresh()
        key = method.identity, recording.name
        # the answer may be lost on its way: then the next process gives it again
        left = last_step if reason.endswith('while it was loaded') else ''
        assert (tmp_path / 'last_step').read_text() == left
        return journal.pairs.get(key, {}), journal.frames.get(key, {}), reason
    return run


def failures(lines):
    """Return later frame -> failure, of the pairs that failed."""
    return {pair.source: line.failure for pair, line in lines.items() if line.failure}


def test_errors_are_those_of_the_ground_truth(method, recording, measured):
    lines, frames, reason = measured(method(), (1, 3))
    count = len(recording.stamps)
    assert (sorted(frames), reason) == (list(range(count)), '')
    assert len(lines) == count - 1 + count - 3
    for (target, source), line in lines.items():
        poses = [recording.ground_truth.at(recording.stamps[i]) for i in (target, source)]
        assert line.translation == pytest.approx(np.linalg.norm(poses[0][:3, 3] - poses[1][:3, 3]))
        assert line.rotation == pytest.approx(
            se3.angle(poses[0][:3, :3].T @ poses[1][:3, :3]), abs=1e-9)
        assert line.milliseconds > 0


@pytest.mark.parametrize(('deed', 'at', 'expected'), [
    ('raise', 'pair', {3: 'raised ValueError'}),
    ('exit', 'pair', {3: 'raised SystemExit'}),
    ('raise', 'frame', dict.fromkeys((3, 4), 'a frame could not be prepared'))])
def test_an_exception_is_a_failure(method, recording, measured, deed, at, expected):
    lines, frames, _ = measured(method(deed, [recording.stamps[3]], at))
    assert failures(lines) == expected
    assert sorted(frames) == [i for i in range(8) if at == 'pair' or i != 3]


@pytest.mark.parametrize(('frames', 'report', 'expected'), [
    ([2, 3], '', {3: 'was killed'}),
    ([2, 3], 'Fatal Python error: Aborted\n\nmore\n', {3: 'crashed (Aborted)'}),
    ([3], 'Timeout (0:00:02)!\n', {3: 'took longer than 2 s', 4: 'took longer than 2 s'})])
def test_the_step_of_a_lost_process_has_failed(method, measured, frames, report, expected):
    lines, _, _ = measured(method(), last_step=json.dumps([frames, 2.0]) + '\n' + report)
    assert failures(lines) == expected
    assert len(lines) == 7
    assert all(line.milliseconds is None for line in lines.values() if line.failure)


def test_a_method_that_crashes_while_it_is_loaded_is_unusable(method, measured):
    lines, _, reason = measured(method(), last_step='[[], 120.0]\nFatal Python error: Aborted\n')
    assert (lines, reason) == ({}, 'crashed (Aborted) while it was loaded')


@pytest.mark.parametrize(('factory', 'message'), [
    ('misbehaving:broken', 'ImportError: libGL.so.1'), ('nowhere:Thing', 'ModuleNotFoundError')])
def test_a_method_that_does_not_start_is_unusable(method, measured, factory, message):
    assert measured(method(factory=factory))[2].startswith(message)


def test_what_is_measured_is_not_measured_again(method, recording, measured):
    first, _, _ = measured(method())
    second, _, _ = measured(method())
    both, _, _ = measured(method(), (1, 3))
    assert first == second == {pair: both[pair] for pair in first}
    assert len(both) == 7 + 5
