# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""When images were really taken, where a driver stamps them on arrival."""

from __future__ import annotations

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

_GAIN = 0.1  # of the phase
_PERIOD_GAIN = _GAIN ** 2 / 4  # critically damped
_MEMORY = 0.05  # of the squared jitter, a frame
_OFF_BEAT = 0.25  # periods; what is farther off does not move the beat
_SETTLED = 15  # stamps on the beat, before which it is not believed
_JUDGED = 2  # stamps on the beat, from which on the next one tells of the jitter
_FORGIVEN = 0.5  # of a stamp off the beat, by one that is on it
_TOO_MANY = 3  # stamps off the beat, after which there is none


class CameraClock:
    """
    A loop that locks to the beat of a camera.

    A camera takes images at a steady rate, but most drivers stamp them when the bus delivers
    them. The loop begins as a straight line through the stamps, then follows the beat through
    late stamps and missing images; where there is no beat the stamps hold. Of stamps that jitter
    by up to a tenth of the period it leaves a quarter of the jitter; by a fifth and more it finds
    no beat in them.
    """

    def __init__(self) -> None:
        self._last: int | None = None  # the last stamp [ns]
        self._steady = 0.0  # the last beat, seconds after the last stamp
        self._period = 0.0
        self._count = 1  # stamps on the beat
        self._misses = 0.0  # stamps off it, some of them forgiven
        self._square = 0.0  # of the jitter [s^2]
        self._squares = 0  # how many stamps it is the mean of

    @property
    def jitter(self) -> float:
        """Standard deviation of the stamps about the beat, or what came nearest to one [s]."""
        return self._square ** 0.5

    @property
    def _has_beat(self) -> bool:
        return self._count >= _SETTLED

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
            self._last = stamp
            self._begin(0.0)
            return 0.0
        interval = (stamp - self._last) / NANOSECONDS
        self._last = stamp
        if self._period == 0.0:
            self._period = interval
        self._follow(interval)
        return self._steady if self._has_beat else 0.0

    def _begin(self, period: float) -> None:
        self._steady, self._period, self._count, self._misses = 0.0, period, 1, 0.0

    def _follow(self, interval: float) -> None:
        due = self._steady - interval  # the last beat, seen from this stamp
        beats = round(-due / self._period)
        late = -(due + beats * self._period)
        self._steady = -late
        is_off = beats == 0 or abs(late) > _OFF_BEAT * self._period
        if self._has_beat or self._count >= _JUDGED and not is_off:
            self._squares += 1
            self._square += max(_MEMORY, 1 / self._squares) * (late ** 2 - self._square)
        if is_off:
            self._misses += 1.0
            if self._misses >= _TOO_MANY or not self._has_beat:
                self._begin(interval)
            return
        self._misses = max(0.0, self._misses - _FORGIVEN)
        self._count += 1
        n = self._count  # at first the gains of a line fitted to the n stamps
        self._steady += late * max(_GAIN, (4 * n - 2) / (n * (n + 1)))
        self._period += late * max(_PERIOD_GAIN, 6 / (n * (n + 1))) / beats
