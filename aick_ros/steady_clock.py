# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""When images were really taken, where a driver stamps them on arrival."""

from __future__ import annotations

from aick_ros.synchronizer import RESTART_AFTER
from aick_ros.trajectory import NANOSECONDS

_GAIN = 0.1  # of the phase
_PERIOD_GAIN = _GAIN ** 2 / 4  # critically damped
_MEMORY = 0.05  # of the squared jitter, a frame
_OFF_BEAT = 0.25  # periods; what is farther off is no jitter


class SteadyClock:
    """
    A loop that locks to the beat of a camera.

    A camera takes images at a steady rate, but most drivers stamp them when the bus delivers
    them. The loop follows the beat through late stamps and missing images; where there is no beat
    it follows the stamps.
    """

    def __init__(self) -> None:
        self._last: int | None = None  # the last stamp [ns]
        self._steady = 0.0  # the last beat, seconds after the last stamp
        self._period = 0.0
        self._square = 0.0  # of the jitter [s^2]

    @property
    def jitter(self) -> float:
        """Standard deviation of the stamps about the beat [s]; 0 before there is one."""
        return self._square ** 0.5

    def is_behind(self, stamp: int) -> bool:
        """Return whether a stamp repeats or goes back a little, and so tells nothing."""
        return self._last is not None and self._last - RESTART_AFTER <= stamp <= self._last

    def correct(self, stamp: int) -> float:
        """
        Take the next stamp and return what to add to it for the time of the image [s].

        :param stamp: [ns]; nothing is learnt from one that :meth:`is_behind`.
        """
        if self.is_behind(stamp):
            return 0.0
        if self._last is None or stamp < self._last:
            self._last, self._steady, self._period = stamp, 0.0, 0.0
            return 0.0
        interval = (stamp - self._last) / NANOSECONDS
        self._last = stamp
        if self._period == 0.0:
            self._period = interval
            return 0.0
        due = self._steady - interval  # the last beat, seen from this stamp
        beats = max(1.0, round(-due / self._period))
        late = -(due + beats * self._period)
        if abs(late) > _OFF_BEAT * self._period:
            self._steady, self._period = 0.0, interval / max(1.0, round(interval / self._period))
            return 0.0
        self._steady = -late * (1.0 - _GAIN)
        self._period += _PERIOD_GAIN * late / beats
        self._square += _MEMORY * (late ** 2 - self._square)
        return self._steady
