# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Signals that are held back, and those that are ignored."""

import signal
import subprocess
import sys
import threading

import pytest

from aick_ros.ros.process.signals import ENDINGS, held, hold

IGNORES = '''
import os, signal
from aick_ros.ros.process.signals import ignore
ignore()
for each in (signal.SIGINT, signal.SIGTERM):
    os.kill(os.getpid(), each)
print('still here')
'''


def send(ending):
    """Send a signal to this thread: another one might take it."""
    signal.pthread_kill(threading.get_ident(), ending)


def blocked():
    return signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.fixture
def seen():
    """Return the signals that arrive, in order."""
    seen = []
    before = {each: signal.signal(each, lambda number, _: seen.append(number))
              for each in ENDINGS}
    yield seen
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDINGS)
    for each, handler in before.items():
        signal.signal(each, handler)


def test_both_that_end_a_program_wait_for_the_end_of_the_block(seen):
    with held():
        for each in ENDINGS:
            send(each)
        assert seen == []
    assert sorted(seen) == [signal.SIGINT, signal.SIGTERM]


def test_an_error_of_the_block_does_not_hold_them_for_ever(seen):
    with pytest.raises(KeyError):
        with held():
            raise KeyError
    send(signal.SIGTERM)
    assert seen == [signal.SIGTERM] and not set(ENDINGS) & blocked()


def test_only_those_that_are_named_are_held(seen):
    with held([signal.SIGTERM]):
        send(signal.SIGINT)
        assert seen == [signal.SIGINT] and signal.SIGTERM in blocked()


def test_those_that_are_held_without_a_block_come_after_the_next(seen):
    hold()
    send(signal.SIGTERM)
    assert seen == []
    with held():
        assert seen == []
    assert seen == [signal.SIGTERM]


def test_a_process_that_is_about_to_end_ignores_them():
    ended = subprocess.run([sys.executable, '-c', IGNORES], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, 'still here\n', '')
