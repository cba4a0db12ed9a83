# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A process ends with its parent, however that ends."""

import os
import signal
import subprocess
import sys
import time

import pytest

from aick_ros.borders.parent import supervised

PROGRAM = """
import os, signal, subprocess, sys, time
from aick_ros.borders.parent import end_with_parent, supervised
if len(sys.argv) > 1:
    if sys.argv[1] == 'default':
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        end_with_parent()
    else:
        end_with_parent(signal.Signals(int(sys.argv[1])))
    print(os.getpid(), flush=True)
    time.sleep(600)
subprocess.run([sys.executable, '-c', os.environ['PROGRAM'], os.environ['ENDING']],
               env=supervised())
"""
PATIENCE = 60.0  # seconds


@pytest.mark.parametrize('ending', [int(signal.SIGTERM), int(signal.SIGKILL), 'default'])
def test_the_child_of_a_parent_that_is_killed_ends(ending):
    """By default whatever signals it ignores."""
    parent = subprocess.Popen(
        [sys.executable, '-c', PROGRAM], stdout=subprocess.PIPE, text=True,
        env={**os.environ, 'PROGRAM': PROGRAM, 'ENDING': str(ending)})
    child = int(parent.stdout.readline())
    parent.kill()
    parent.wait()
    deadline = time.monotonic() + PATIENCE
    while _runs(child) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not _runs(child)


def test_a_parent_that_has_ended_before_is_noticed():
    run = subprocess.run(
        [sys.executable, '-c', PROGRAM, '15'], env={**os.environ, 'AICK_PARENT_PROCESS': '1'})
    assert run.returncode == 1


def test_without_a_supervisor_nothing_happens():
    program = ('from aick_ros.borders.parent import end_with_parent; end_with_parent(); '
               'print("runs")')
    run = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True)
    assert (run.returncode, run.stdout) == (0, 'runs\n')


def _runs(pid):
    try:
        with open(f'/proc/{pid}/stat') as file:
            return file.read().rpartition(')')[2].split()[0] != 'Z'
    except OSError:
        return False


def test_the_children_of_a_supervised_process_are_not_supervised_by_it():
    program = ('import os; from aick_ros.borders.parent import end_with_parent; '
               'end_with_parent(); print("AICK_PARENT_PROCESS" in os.environ)')
    run = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                         env=supervised())
    assert (run.returncode, run.stdout) == (0, 'False\n')
    assert supervised()['AICK_PARENT_PROCESS'] == str(os.getpid())
    assert 'AICK_PARENT_PROCESS' not in os.environ
