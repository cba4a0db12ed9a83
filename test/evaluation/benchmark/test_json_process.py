# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Processes that answer, wait, crash and leave children behind."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from aick_ros.evaluation.benchmark import method_process
from aick_ros.evaluation.benchmark.json_process import JsonProcess

MODULE = '''
import json, os, pathlib, subprocess, sys, time
for name, value in json.loads(sys.stdin.readline()):
    if name == 'say':
        print(json.dumps({'said': value}), flush=True)
    if name == 'sleep':
        child = subprocess.Popen(['sleep', '3600'])
        print(json.dumps({'pid': child.pid}), flush=True)
        time.sleep(3600)
    if name == 'environment':
        print(json.dumps({'value': os.environ.get(value)}), flush=True)
    if name == 'abort':
        os.abort()
    if name == 'exit':
        sys.exit(value)
'''
PATIENT = 120.0
NEVER = bool


@pytest.fixture
def start(tmp_path, monkeypatch):
    """Return a function that starts a process that performs the steps."""
    (tmp_path / 'answering.py').write_text(MODULE)
    monkeypatch.setenv('PYTHONPATH', str(tmp_path))
    return lambda *steps: JsonProcess('answering', steps)


def test_answers_come_in_order_and_end(start):
    with start(('say', 1), ('say', {'two': None})) as process:
        answers = [process.next(PATIENT, NEVER) for _ in range(3)]
    assert answers == [{'said': 1}, {'said': {'two': None}}, None]


def test_blas_has_one_thread(start):
    with start(('environment', 'OPENBLAS_NUM_THREADS')) as process:
        assert process.next(PATIENT, NEVER) == {'value': '1'}


def test_a_wait_is_limited_and_children_are_killed(start, wait_for_end):
    with start(('sleep', None)) as process:
        child = process.next(PATIENT, NEVER)['pid']
        with pytest.raises(TimeoutError, match='longer than 0.2 s'):
            process.next(0.2, NEVER)
    wait_for_end(child)


def test_a_user_who_stops_does_not_wait(start):
    with start(('sleep', None)) as process:
        assert process.next(PATIENT, lambda: True) is None


@pytest.mark.parametrize(('step', 'cause'), [
    (('abort', None), signal.SIGABRT.name),
    (('exit', 'first\nno licence found'), 'exit code 1: no licence found'),
    (('exit', 'x' * 500), 'exit code 1: ' + 'x' * 200)])
def test_the_cause_of_an_exit_is_named(start, step, cause):
    with start(step) as process:
        assert process.next(PATIENT, NEVER) is None
        assert process.cause_of_exit() == cause


WAITING = '''
import json, os, time
from aick_ros.borders.parent import end_with_parent
end_with_parent()
print(json.dumps({'pid': os.getpid()}), flush=True)
time.sleep(3600)
'''
PARENT = '''
import time
from aick_ros.evaluation.benchmark.json_process import JsonProcess
with JsonProcess('waiting', None) as process:
    print(process.next(120.0, bool)['pid'], flush=True)
    time.sleep(3600)
'''


@pytest.mark.parametrize('how', [signal.SIGKILL, signal.SIGTERM])
def test_a_process_ends_with_its_parent_however_that_ends(tmp_path, wait_for_end, how):
    (tmp_path / 'waiting.py').write_text(WAITING)
    root = Path(__file__).parents[3]
    parent = subprocess.Popen(
        [sys.executable, '-c', PARENT], stdout=subprocess.PIPE, text=True,
        env={**os.environ, 'PYTHONPATH': f'{root}{os.pathsep}{tmp_path}'})
    child = int(parent.stdout.readline())
    parent.send_signal(how)
    parent.wait()
    parent.stdout.close()
    wait_for_end(child)


def test_methods_end_with_the_benchmark(monkeypatch):
    def called():
        raise InterruptedError
    monkeypatch.setattr(method_process, 'end_with_parent', called)
    with pytest.raises(InterruptedError):
        method_process.main()
