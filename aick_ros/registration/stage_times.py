# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Time that each stage of the registration of a frame takes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

clock = time.perf_counter
"""The clock that times are read from; a benchmark counts processor time instead."""

STAGES = ('features', 'surface', 'registration', 'refinement')
"""Stages in the order of processing; a frame may skip some."""


class StageTimes:
    """Sums of the time spent in each stage."""

    def __init__(self) -> None:
        self._milliseconds = dict.fromkeys(STAGES, 0.0)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Add the time inside the with statement to a stage, one of :data:`STAGES`."""
        start = clock()
        try:
            yield
        finally:
            self._milliseconds[name] += 1e3 * (clock() - start)

    def add(self, others: StageTimes) -> None:
        """Add the times of others, and reset these."""
        for stage, milliseconds in others._milliseconds.items():
            self._milliseconds[stage] += milliseconds
        others.take()

    def take(self) -> dict[str, float]:
        """Return the milliseconds of each stage since the last call, and their ``total``."""
        taken, self._milliseconds = self._milliseconds, dict.fromkeys(STAGES, 0.0)
        return {**taken, 'total': sum(taken.values())}
