# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""When the messages of a bag are due."""

from __future__ import annotations

import sys
import time

from aick_ros.geometry.stamps import NANOSECONDS


class RealTime:
    """
    Due as they were recorded.

    :param rate: times as fast; infinite: as fast as the publishers take them.
    """

    def __init__(self, rate: float = 1.0) -> None:
        self._rate = rate
        self._start: tuple[int, float] | None = None

    def __call__(self, stamp: int) -> None:
        """Return when a message of this stamp [ns] is due."""
        now = time.monotonic()
        if self._start is None:
            self._start = stamp, now
        due = self._start[1] + (stamp - self._start[0]) / NANOSECONDS / self._rate
        if due > now:
            time.sleep(due - now)


class StepByStep:
    """
    Due when a person, or a program, says so: one line on standard input a step.

    :param step: messages nearer in time than this belong to one step [s].
    """

    def __init__(self, step: float = 0.02) -> None:
        self._step = round(step * NANOSECONDS)
        self._last: int | None = None

    def __call__(self, stamp: int) -> None:
        """
        Return when a message of this stamp [ns] is due.

        :raises EOFError: where standard input has ended.
        """
        if self._last is None or stamp - self._last > self._step:
            print(f'{stamp / NANOSECONDS:.3f} s, Enter plays on', file=sys.stderr, flush=True)
            if not sys.stdin.readline():
                raise EOFError
            self._last = stamp
