# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Ctrl-C as a wish to end, so that what is written until then is complete."""

from __future__ import annotations

import signal
from types import FrameType


class Interruption:
    """While it is entered, the first Ctrl-C is a wish, the second ends at once."""

    def __init__(self) -> None:
        self.requested = False

    def __enter__(self) -> Interruption:
        """Listen to Ctrl-C."""
        self._previous = signal.signal(signal.SIGINT, self._on_signal)
        return self

    def __exit__(self, *_: object) -> None:
        """Leave Ctrl-C as it was."""
        signal.signal(signal.SIGINT, self._previous)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
