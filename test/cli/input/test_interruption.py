# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Signals that end a command, during a block and after it."""

import signal
import sys

import pytest

from aick_ros.cli.input.interruption import Interruption, endings, endings_interrupt

ALL = signal.SIGINT, signal.SIGTERM, signal.SIGHUP


@pytest.fixture
def handlers():
    """Return a function that gives the handling of the signals, which is restored at the end."""
    before = {each: signal.signal(each, signal.SIG_DFL) for each in ALL}
    hook = sys.unraisablehook
    signal.signal(signal.SIGINT, signal.default_int_handler)
    yield lambda: [signal.getsignal(each) for each in ALL]
    sys.unraisablehook = hook
    for each, handler in before.items():
        signal.signal(each, handler)


@pytest.mark.usefixtures('handlers')
def test_the_end_of_the_terminal_is_one_unless_it_is_ignored():
    assert endings() == ALL
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    assert endings() == ALL[:2]


@pytest.mark.parametrize('ending', ALL)
def test_each_raises_during_the_block_and_is_as_before_after_it(handlers, ending):
    before, hook = handlers(), sys.unraisablehook
    with endings_interrupt():
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(ending)
    assert handlers() == before
    assert sys.unraisablehook is hook


@pytest.mark.parametrize('ending', ALL)
def test_after_the_last_block_of_the_process_all_are_ignored(handlers, ending):
    with pytest.raises(KeyboardInterrupt), endings_interrupt(is_last=True):
        signal.raise_signal(ending)
    assert handlers() == 3 * [signal.SIG_IGN]


@pytest.mark.usefixtures('handlers')
@pytest.mark.parametrize('is_last', [False, True])
def test_errors_of_finalizers_are_reported_but_for_signals(capfd, is_last):
    class Ending:
        def __init__(self, kind):
            self.kind = kind

        def __del__(self):
            raise self.kind('in a finalizer')

    elsewhere = []
    sys.unraisablehook = lambda error: elsewhere.append(error.exc_type)
    with endings_interrupt(is_last):
        Ending(ValueError)
        assert 'ValueError: in a finalizer' in capfd.readouterr().err
        Ending(KeyboardInterrupt)
    Ending(KeyboardInterrupt)
    assert elsewhere == [KeyboardInterrupt] * (not is_last)
    assert capfd.readouterr().err == ''


@pytest.mark.usefixtures('handlers')
def test_nothing_is_requested_before_the_first_signal():
    with Interruption() as interruption:
        assert not interruption.requested
        signal.raise_signal(signal.SIGTERM)
        assert interruption.requested
