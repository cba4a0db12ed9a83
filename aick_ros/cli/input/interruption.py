# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Signals that end a program as requests to stop, so that the output stays complete."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from aick_ros.ros.process.signals import ENDINGS


def endings() -> tuple[signal.Signals, ...]:
    """
    Return the signals that end a command: Ctrl-C, SIGTERM, and the end of its terminal.

    The last one, SIGHUP, is ignored after nohup, and stays so.
    """
    hangs_up = signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN
    return (*ENDINGS, *[signal.SIGHUP] * hangs_up)


class Interruption:
    """Inside the ``with`` block, the first signal is a request, the second ends at once."""

    def __init__(self) -> None:
        self.requested = False

    def __enter__(self) -> Interruption:
        """Catch the signals that end a command."""
        self._previous = {each: signal.signal(each, self._on_signal) for each in endings()}
        return self

    def __exit__(self, *_: object) -> None:
        """Restore their handling."""
        for each, previous in self._previous.items():
            signal.signal(each, previous)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True


@contextmanager
def endings_interrupt(is_last: bool = False) -> Iterator[None]:
    """
    Make all signals that end a command raise KeyboardInterrupt during the block, as Ctrl-C.

    A further one that comes while Python cleans up after the first is not reported.

    :param is_last: the process ends after the block, and ignores them then; they are not blocked,
        as any other thread would get them.
    """
    previous = {each: signal.signal(each, signal.default_int_handler)
                for each in endings() if each is not signal.SIGINT}
    hook, sys.unraisablehook = sys.unraisablehook, _report_unraisable
    try:
        yield
    finally:
        sys.unraisablehook = hook if not is_last else _report_unraisable
        for each, handler in previous.items():
            signal.signal(each, signal.SIG_IGN if is_last else handler)
        if is_last:
            signal.signal(signal.SIGINT, signal.SIG_IGN)


def _report_unraisable(error: sys.UnraisableHookArgs) -> None:
    """Report an error of a finalizer, unless it is a signal."""
    if not issubclass(error.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(error)
