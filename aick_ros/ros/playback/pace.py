# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pace at which the messages of a bag are played."""

from __future__ import annotations

import sys
import time

from aick_ros.geometry.stamps import NANOSECONDS

_LONGEST_WAIT = 86400.0  # seconds; chosen: time.sleep takes no number of years


class RealTime:
    """
    Waits until a message is due, by the time of its recording.

    :param rate: playback rate, 1 as recorded; infinite: no waiting.
    """

    def __init__(self, rate: float = 1.0) -> None:
        self._rate = rate
        self._start: tuple[int, float] | None = None

    def __call__(self, stamp: int) -> None:
        """Wait until a message recorded at this time [ns] is due."""
        now = time.monotonic()
        if self._start is None:
            self._start = stamp, now
        due = self._start[1] + (stamp - self._start[0]) / NANOSECONDS / self._rate
        if due > now:
            time.sleep(min(due - now, _LONGEST_WAIT))


class StepByStep:
    """
    Waits for one line on standard input per step.

    :param step: messages within this time belong to one step [s].
    """

    def __init__(self, step: float = 0.02) -> None:
        self._step = round(step * NANOSECONDS)
        self._last: int | None = None

    def __call__(self, stamp: int) -> None:
        """
        Wait until a message recorded at this time [ns] is due.

        :raises EOFError: where standard input has ended.
        """
        if self._last is None or stamp - self._last > self._step:
            print(f'{stamp / NANOSECONDS:.3f} s, Enter continues', file=sys.stderr, flush=True)
            if not sys.stdin.readline():
                raise EOFError
            self._last = stamp
