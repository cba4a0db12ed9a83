# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Requests that are for the frames after them: a pause and a reset."""

from __future__ import annotations

import math
import time

from aick_ros.ros.health.counts import Count


class Interruption:
    """The last request of that kind: frames that were waiting then are not answered."""

    def __init__(self) -> None:
        self._at, self._count = -math.inf, Count.DROPPED_BY_RESET

    def begin(self, count: Count) -> None:
        """
        Interrupt the frames that have been paired so far.

        :param count: what they are counted as.
        """
        self._count, self._at = count, time.monotonic()

    def of(self, paired_at: float) -> Count | None:
        """
        Return what a frame is counted as that is not answered; None where it is.

        :param paired_at: steady time [s].
        """
        return self._count if paired_at <= self._at else None
