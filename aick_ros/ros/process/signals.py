# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The signals that end a program: Ctrl-C and what launch and systemd send."""

from __future__ import annotations

import signal
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

ENDINGS = (signal.SIGINT, signal.SIGTERM)


def hold(endings: Iterable[signal.Signals] = ENDINGS) -> None:
    """Hold the signals back until the end of the next block of :func:`held`."""
    signal.pthread_sigmask(signal.SIG_BLOCK, endings)


@contextmanager
def held(endings: Iterable[signal.Signals] = ENDINGS) -> Iterator[None]:
    """Hold the signals back until the end of the block."""
    hold(endings)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, endings)


def ignore() -> None:
    """Ignore the signals from here on: the process is about to end by itself."""
    for ending in ENDINGS:
        signal.signal(ending, signal.SIG_IGN)
