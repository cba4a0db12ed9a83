# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Signals of the terminal, which the processes of the engine do not receive."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

OF_THE_TERMINAL = {signal.SIGINT, signal.SIGHUP}


@contextmanager
def unreached_by_the_terminal() -> Iterator[None]:
    """
    Block Ctrl-C and the end of the terminal for threads and processes that the block starts.

    The terminal sends them to all processes, but they are for this one, which ends the others.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, OF_THE_TERMINAL)
    try:
        resource_tracker.ensure_running()  # the start of this process unblocks Ctrl-C
        signal.pthread_sigmask(signal.SIG_BLOCK, OF_THE_TERMINAL)
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
