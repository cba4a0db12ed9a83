# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Time that each stage of the registration of a frame takes."""

from __future__ import annotations

import time

clock = time.perf_counter
"""The clock that times are read from; a benchmark counts processor time instead."""

STAGES = ('features', 'surface', 'registration', 'refinement')
"""Stages in the order of processing; a frame may skip some."""


class StageTimes:
    """Sums of the time spent in each stage."""

    def __init__(self) -> None:
        self._milliseconds = dict.fromkeys(STAGES, 0.0)

    def stage(self, name: str) -> _Stage:
        """Return a context that adds the time inside it to a stage, one of :data:`STAGES`."""
        return _Stage(self, name)

    def count(self, stage: str, seconds: float) -> None:
        """Add a time to a stage."""
        self._milliseconds[stage] += 1e3 * seconds

    def add(self, others: StageTimes) -> None:
        """Add the times of others, and reset these."""
        for stage, milliseconds in others._milliseconds.items():
            self._milliseconds[stage] += milliseconds
        others.take()

    def take(self) -> dict[str, float]:
        """Return the milliseconds of each stage since the last call, and their ``total``."""
        taken, self._milliseconds = self._milliseconds, dict.fromkeys(STAGES, 0.0)
        return {**taken, 'total': sum(taken.values())}


class _Stage:
    """The time inside a with statement, that of one which fails too."""

    def __init__(self, times: StageTimes, name: str) -> None:
        self._times, self._name = times, name

    def __enter__(self) -> None:
        self._start = clock()

    def __exit__(self, *_: object) -> None:
        self._times.count(self._name, clock() - self._start)
