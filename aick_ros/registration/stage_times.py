# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How long the stages of a frame take."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

STAGES = ('features', 'surface', 'registration', 'refinement')
"""What a frame goes through; not every frame goes through all."""


class StageTimes:
    """Sums up the time of the stages."""

    def __init__(self) -> None:
        self._milliseconds = dict.fromkeys(STAGES, 0.0)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Count the time inside the with statement; the name is one of :data:`STAGES`."""
        start = time.perf_counter()
        try:
            yield
        finally:
            spent = 1e3 * (time.perf_counter() - start)
            self._milliseconds[name] += spent

    def take(self) -> dict[str, float]:
        """Return the milliseconds of each stage since the last call, and their ``total``."""
        taken, self._milliseconds = self._milliseconds, dict.fromkeys(STAGES, 0.0)
        return {**taken, 'total': sum(taken.values())}
