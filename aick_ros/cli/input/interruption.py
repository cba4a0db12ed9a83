# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Ctrl-C as a request to stop, so that the output stays complete."""

from __future__ import annotations

import signal
from types import FrameType


class Interruption:
    """Inside the ``with`` block, the first Ctrl-C is a request, the second ends at once."""

    def __init__(self) -> None:
        self.requested = False

    def __enter__(self) -> Interruption:
        """Catch Ctrl-C."""
        self._previous = signal.signal(signal.SIGINT, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the handling of Ctrl-C."""
        signal.signal(signal.SIGINT, self._previous)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
