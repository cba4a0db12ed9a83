# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A limit of the frame rate that skips frames evenly."""

from __future__ import annotations

from aick_ros.geometry.stamps import MAX_STAMP, NANOSECONDS, RESTART_AFTER

_JITTER = 0.1  # of a period, by which a frame may come early; chosen


class RateLimit:
    """
    Chooses frames by their stamps.

    :param rate: largest rate of chosen frames [Hz]; 0: no limit.
    """

    def __init__(self, rate: float) -> None:
        self._period = round(min(NANOSECONDS / rate, MAX_STAMP)) if rate else 0
        self._due: int | None = None

    def admits(self, stamp: int) -> bool:
        """Return whether the frame of a stamp [ns] is chosen."""
        if not self._period:
            return True
        if self._due is None or self._due - stamp > self._period + RESTART_AFTER:
            self._due = stamp  # the first one, or a recording that started again
        if stamp < self._due - _JITTER * self._period:
            return False
        self._due = max(self._due, stamp - self._period) + self._period
        return True
