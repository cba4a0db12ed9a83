# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Ctrl-C and SIGTERM as requests to stop, so that the output stays complete."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """Inside the ``with`` block, the first Ctrl-C is a request, the second ends at once."""

    def __init__(self) -> None:
        self.requested = False

    def __enter__(self) -> Interruption:
        """Catch Ctrl-C and SIGTERM."""
        self._previous = [signal.signal(each, self._on_signal) for each in _SIGNALS]
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the handling of Ctrl-C and SIGTERM."""
        for each, previous in zip(_SIGNALS, self._previous):
            signal.signal(each, previous)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True


@contextmanager
def sigterm_interrupts() -> Iterator[None]:
    """Make SIGTERM raise KeyboardInterrupt during the block, as Ctrl-C does."""
    previous = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)
