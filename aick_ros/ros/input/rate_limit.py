# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Leaves frames out evenly where they come faster than they are wanted."""

from __future__ import annotations

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

_JITTER = 0.1  # of a period: how much too early a frame may come


class RateLimit:
    """
    Chooses frames by their stamps.

    :param rate: frames a second at most [Hz]; 0: all.
    """

    def __init__(self, rate: float) -> None:
        self._period = round(NANOSECONDS / rate) if rate else 0
        self._due: int | None = None

    def admits(self, stamp: int) -> bool:
        """Return whether the frame of a stamp [ns] is wanted."""
        if not self._period:
            return True
        if self._due is None or self._due - stamp > self._period + RESTART_AFTER:
            self._due = stamp  # the first one, or a recording that started again
        if stamp < self._due - _JITTER * self._period:
            return False
        self._due = max(self._due, stamp - self._period) + self._period
        return True
