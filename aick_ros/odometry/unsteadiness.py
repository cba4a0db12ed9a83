# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
By how much the velocity of a camera at a frame errs.

It is that of the interval before the frame, continued. The interval after it shows the error: the
velocity at the frame is between those of the two.
"""

from __future__ import annotations

import numpy as np

from aick_ros.geometry.pose import Increment
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.prediction import CHANGE

_MEMORY = 30  # increments that the mean is over; chosen, as of all that is learned of a motion

_RATIO = 1.4
"""Mean square of the errors, as a ratio to what the intervals show, which have means of their own.

Chosen; 1 to 2 on rendered cameras at 10 to 60 Hz."""


class Unsteadiness:
    """Errors of the velocities of one camera, in time order."""

    def __init__(self) -> None:
        self._end: int | None = None  # stamp of the last increment [ns]
        self._twist, self._interval = np.zeros(6), 0.0  # of it
        self._change: np.ndarray | None = None  # to it, if the one before it is known
        self._count = 0
        self._squares = np.zeros(6)

    @property
    def squares(self) -> np.ndarray | None:
        """
        Mean squares of the errors by the interval before the frame, 6 [m^2/s^4, rad^2/s^4].

        None: not known yet.
        """
        return self._squares if self._count else None

    def learn(self, increment: Increment, stamp: int) -> None:
        """Learn from the motion of the camera up to a stamp [ns]."""
        begin = stamp - round(NANOSECONDS * increment.interval)
        twist, change = increment.twist, None
        if self._end == begin:
            change = twist - self._twist
            if self._change is not None:
                to_frame = self._interval / (self._interval + increment.interval) * change
                self._add((to_frame - (CHANGE - 1.0) * self._change) / self._interval)
        self._end, self._interval = stamp, increment.interval
        self._twist, self._change = twist, change

    def _add(self, error: np.ndarray) -> None:
        self._count = min(self._count + 1, _MEMORY)
        self._squares = self._squares + (
            _RATIO * np.square(error) - self._squares) / self._count
