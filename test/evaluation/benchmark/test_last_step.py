# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Why a process was lost, by processes that hang, crash and are killed."""

import json
import subprocess
import sys

import pytest

from aick_ros.evaluation.benchmark.last_step import LastStep, Loss

PROGRAM = '''
import os, pathlib, signal, sys, time
from aick_ros.evaluation.benchmark.last_step import LastStep
with LastStep(pathlib.Path(sys.argv[1])) as steps:
    with steps.step(100.0, [9, 8]):
        pass
    with steps.step({limit}, {frames}):
        {end}
'''


def lost(tmp_path, end, limit=60.0, frames=()):
    """Return the loss that is read after a process has ended in a step."""
    path = tmp_path / 'step'
    subprocess.run([sys.executable, '-c', PROGRAM.format(end=end, limit=limit, frames=frames),
                    str(path)], capture_output=True)
    return LastStep(path).loss


@pytest.mark.parametrize('end, frames, reason', [
    ('os.kill(os.getpid(), signal.SIGKILL)', (3, 5), 'was killed'),
    ('os.abort()', (4,), 'crashed (Aborted)'),
    ('os.kill(os.getpid(), signal.SIGSEGV)', (), 'crashed (Segmentation fault)')])
def test_a_loss_has_the_frames_of_its_step_and_a_cause(tmp_path, end, frames, reason):
    assert lost(tmp_path, end, frames=frames) == Loss(frames, reason)


def test_a_step_that_takes_too_long_is_ended(tmp_path):
    assert lost(tmp_path, 'time.sleep(60)', 0.2, (1, 2)) == Loss((1, 2), 'took longer than 0.2 s')


def test_an_error_of_python_is_no_loss(tmp_path):
    assert lost(tmp_path, 'raise ValueError') is None


def test_during_a_step_the_file_has_it_and_after_it_nothing(tmp_path):
    path = tmp_path / 'step'
    with LastStep(path) as steps:
        assert steps.loss is None
        for frames in ((1, 2), (7,), ()):
            with steps.step(5.0, frames):
                assert json.loads(path.read_text()) == [list(frames), 5.0]
            assert path.read_text() == ''
        with pytest.raises(KeyError):
            with steps.step(5.0):
                raise KeyError
        assert path.read_text() == ''


def test_a_loss_is_reported_once(tmp_path):
    path = tmp_path / 'step'
    path.write_text('[[1, 2], 3.0]\n')
    assert LastStep(path).loss == Loss((1, 2), 'was killed')
    assert LastStep(path).loss is None
