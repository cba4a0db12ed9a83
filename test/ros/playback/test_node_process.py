# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The command line and the end of a process, by programs that tell of them."""

import json
import signal
import sys
import time

import pytest

from aick_ros.ros.playback import node_process
from aick_ros.ros.playback.node_process import node_process as started

TELLS = 'import json, sys; json.dump(sys.argv[1:], open({!r}, "w"))'
WAITS = '''
import pathlib, signal, sys, time
def on_signal(*_):
    pathlib.Path({path!r}).write_text('interrupted')
    if {ends}:
        sys.exit(5)
signal.signal(signal.SIGINT, on_signal)
signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGINT, signal.SIGTERM])
pathlib.Path({path!r}).write_text('started')
while True:
    time.sleep(0.01)
'''


def python(text):
    return sys.executable, '-c', text


def wait_for(path):
    deadline = time.monotonic() + 60
    while not path.exists() or not path.read_text():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_names_and_values_are_written_as_ros_reads_them(tmp_path):
    path = tmp_path / 'arguments'
    with started(python(TELLS.format(str(path))), {'rgb/image': '/a', 'depth/image': '/b'},
                 {'publish_tf': False, 'x.y': 2.5, 'name': 'abc', 'pose': (0.0, 1.0)}) as process:
        assert process.wait(60) == 0
    assert json.loads(path.read_text()) == [
        '--ros-args', '-r', 'rgb/image:=/a', '-r', 'depth/image:=/b', '-p', 'publish_tf:=false',
        '-p', 'x.y:=2.5', '-p', 'name:=abc', '-p', 'pose:=[0.0, 1.0]']


def test_signals_wait_until_the_program_handles_them(tmp_path):
    """Ctrl-C reaches all processes of a terminal, Python's start among them."""
    path = tmp_path / 'held'
    tells = f"""
import signal
held = signal.pthread_sigmask(signal.SIG_BLOCK, ())
open({str(path)!r}, 'w').write(' '.join(sorted(each.name for each in held)))
"""
    with started(python(tells), {}, {}) as process:
        assert process.wait(60) == 0
    assert path.read_text() == 'SIGINT SIGTERM'
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, ()) & {signal.SIGINT, signal.SIGTERM}


def test_it_is_interrupted_after_the_block_and_after_an_error_of_it(tmp_path):
    path = tmp_path / 'state'
    with pytest.raises(ZeroDivisionError):
        with started(python(WAITS.format(path=str(path), ends=True)), {}, {}) as process:
            wait_for(path)
            assert process.poll() is None
            raise ZeroDivisionError
    assert path.read_text() == 'interrupted' and process.returncode == 5


def test_one_that_does_not_end_is_killed(tmp_path, monkeypatch):
    monkeypatch.setattr(node_process, '_END_TIMEOUT', 0.2)
    path = tmp_path / 'state'
    with started(python(WAITS.format(path=str(path), ends=False)), {}, {}) as process:
        wait_for(path)
    assert path.read_text() == 'interrupted' and process.returncode == -9
