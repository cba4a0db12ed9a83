# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Methods that crash, hang, raise and print: which pairs fail, and that the rest goes on."""

from pathlib import Path

import numpy as np
import pytest

from aick_ros.evaluation.benchmark.journal import FrameLine, PairLine
from aick_ros.evaluation.benchmark.supervisor import Job, UnusableMethodError, supervise
from aick_ros.geometry import se3

NEVER = bool  # is_stopped() of a user who does not stop


def measure(method, recording, gaps=(1,), time_limit=60.0, is_stopped=NEVER):
    """Return the lines of the pairs, by pair, and the frames prepared."""
    lines = []
    supervise(Job(method, recording, recording.pairs(gaps)), time_limit, lines.append, is_stopped)
    pairs = [line for line in lines if isinstance(line, PairLine)]
    assert len({line.pair for line in pairs}) == len(pairs)
    return ({line.pair: line for line in pairs},
            [line.frame for line in lines if isinstance(line, FrameLine)])


def failures(lines):
    """Return later frame -> failure, of the pairs that failed."""
    return {pair.source: line.failure for pair, line in lines.items() if line.failure}


def test_errors_are_those_of_the_ground_truth(method, recording):
    lines, frames = measure(method(), recording, (1, 3))
    count = len(recording.stamps)
    assert frames == list(range(count))
    assert len(lines) == count - 1 + count - 3
    for (target, source), line in lines.items():
        poses = [recording.ground_truth.at(recording.stamps[i]) for i in (target, source)]
        assert line.translation == pytest.approx(np.linalg.norm(poses[0][:3, 3] - poses[1][:3, 3]))
        assert line.rotation == pytest.approx(
            se3.angle(poses[0][:3, :3].T @ poses[1][:3, :3]), abs=1e-9)
        assert line.milliseconds > 0


def test_a_crash_fails_its_pair_only(method, recording):
    lines, frames = measure(method('crash', [recording.stamps[3]]), recording, (1, 2))
    assert failures(lines) == {3: 'crashed (SIGABRT)'}
    # each of the pairs with this later frame crashed a process
    assert sum(bool(line.failure) for line in lines.values()) == 2
    assert len(lines) == 13
    assert all(line.milliseconds is None for line in lines.values() if line.failure)


def test_a_hang_is_ended(method, recording, wait_for_end):
    lines, _ = measure(method('hang', [recording.stamps[2]]), recording, time_limit=3.0)
    assert failures(lines) == {2: 'took longer than 3 s'}
    assert len(lines) == 7
    wait_for_end(int(Path('helper').read_text()))  # of the process that the method started


def test_a_crash_at_a_frame_fails_the_pairs_of_that_frame(method, recording):
    lines, _ = measure(method('crash', [recording.stamps[4]], 'frame'), recording)
    assert failures(lines) == {4: 'crashed (SIGABRT)', 5: 'crashed (SIGABRT)'}


def test_a_method_that_always_crashes_is_given_up(method, recording):
    lines, _ = measure(method('crash', 'always'), recording)
    causes = failures(lines)
    assert len(causes) == 7
    assert list(causes.values()).count('crashed (SIGABRT)') == 3
    assert list(causes.values()).count('given up after 3 crashes or hangs') == 4


def test_the_message_of_an_exit_is_reported(method, recording):
    lines, _ = measure(method('exit', [recording.stamps[1]]), recording)
    assert failures(lines) == {1: 'crashed (exit code 1: no licence found)'}


@pytest.mark.parametrize(('at', 'expected'), [
    ('pair', {3: 'raised ValueError'}),
    ('frame', dict.fromkeys((3, 4), 'a frame could not be prepared'))])
def test_an_exception_is_a_failure(method, recording, at, expected):
    lines, frames = measure(method('raise', [recording.stamps[3]], at), recording)
    assert failures(lines) == expected
    assert frames == [i for i in range(8) if at == 'pair' or i != 3]


def test_printed_text_is_no_answer(method, recording):
    lines, _ = measure(method('print', 'always'), recording)
    assert failures(lines) == {}
    assert len(lines) == 7


@pytest.mark.parametrize(('factory', 'message'), [
    ('misbehaving:broken', 'ImportError: libGL.so.1'),
    ('misbehaving:breaks_down', r'crashed \(SIGABRT\) while it was loaded'),
    ('nowhere:Thing', 'ModuleNotFoundError')])
def test_a_method_that_does_not_start_is_unusable(method, recording, factory, message):
    with pytest.raises(UnusableMethodError, match=message):
        measure(method(factory=factory), recording)


def test_a_stopped_run_leaves_the_remaining_pairs(method, recording):
    done = []
    supervise(Job(method('hang', [recording.stamps[3]]), recording, recording.pairs([1])), 60.0,
              done.append, lambda: any(isinstance(line, PairLine) for line in done))
    pairs = [line for line in done if isinstance(line, PairLine)]
    assert 1 <= len(pairs) <= 2
    assert not any(line.failure for line in pairs)
