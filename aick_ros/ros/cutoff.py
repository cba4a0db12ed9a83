# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames that are discarded, as a pause or a reset came after them."""

from __future__ import annotations

import math
import time

from aick_ros.ros.health.counts import Count


class Cutoff:
    """The time of the last pause or reset: what was paired before it is not answered."""

    def __init__(self) -> None:
        self._at, self._count = -math.inf, Count.DROPPED_BY_RESET

    def set(self, count: Count) -> None:
        """
        Discard the frames that have been paired so far.

        :param count: what they are counted as.
        """
        self._count, self._at = count, time.monotonic()

    def count_of(self, paired_at: float) -> Count | None:
        """
        Return what a discarded frame is counted as; None where the frame is to be answered.

        :param paired_at: steady time [s].
        """
        return self._count if paired_at <= self._at else None
