# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
By how much a velocity changes from interval to interval, by its change over several of them.

The change over n intervals is n times as large while it is steady. What noise adds is not: over
two and more intervals it is the same, be it noise of the velocities or of the poses between them.
So the change over several intervals exceeds that over two by n^2 - 4 squares of the one over one.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from aick_ros.geometry.pose import sums_along_and_about

# Chosen on two excerpts of real recordings.
_LAG = 0.11  # s: a hand's change is steady for about so long; three intervals at 30 Hz
_SHORTEST = 3  # intervals; at lower rates the change over one is well above noise
_LONGEST = 16  # intervals that are kept
_EVEN = 0.25  # largest difference of intervals that are alike, as a share of the last one
_FEWEST = 10  # changes before they are used
_MEMORY = 30  # of them that the mean is over

_STEADY = 0.7
"""Share of the square of a change that is steady over such a time. Derived: of a swing of 3 Hz;
of slower ones it is more, so that the change is overestimated by up to 40 %."""

_ERROR = 0.5  # chosen: standard deviation of that share, as a ratio to what is found by it


class LaggedChange:
    """Changes of the velocity of one camera over several intervals, in time order."""

    def __init__(self) -> None:
        self._past = deque[tuple[float, np.ndarray]](maxlen=_LONGEST)
        self._count = 0
        self._mean, self._with_noise = np.zeros(2), np.zeros(2)

    def add(self, time: float, twist: np.ndarray) -> None:
        """
        Take the velocity of the next interval.

        :param time: middle of the interval [s].
        :param twist: body velocity [m/s, rad/s].
        """
        self._past.append((time, twist))
        count = self._even_intervals()
        if count >= _SHORTEST:
            several, two = (sums_along_and_about(np.square(twist - self._past[-1 - each][1]))
                            for each in (count, 2))
            self._learn(several, two, count)

    def _even_intervals(self) -> int:
        """Return the number of the last intervals that are alike, within the time of a lag."""
        newest, count = self._past[-1][0], 0
        interval = newest - self._past[-2][0] if len(self._past) > 1 else 0.0
        for count, (time, _) in enumerate(reversed(self._past)):
            ahead = newest - time
            if ahead > _LAG or abs(ahead - count * interval) > _EVEN * interval:
                return count - 1
        return count

    def _learn(self, several: np.ndarray, two: np.ndarray, count: int) -> None:
        """Take the squares of the changes over several and over two intervals, 2 each."""
        scale = _STEADY * (count ** 2 - 4)
        self._count = min(self._count + 1, _MEMORY)
        self._mean = self._mean + ((several - two) / scale - self._mean) / self._count
        self._with_noise = self._with_noise + (several / scale - self._with_noise) / self._count

    def restart(self) -> None:
        """Forget the velocities, as after a gap: the next one does not continue the last."""
        self._past.clear()

    def combined(self, mean: np.ndarray, sigma: np.ndarray) -> np.ndarray:
        """
        Return the mean square of the change over one interval, 2.

        It is that of these changes and another one, each by its variance.

        :param mean: the other one, of translation and rotation; ``sigma``: its standard deviation.
        """
        if self._count < _FEWEST:
            return mean
        # a mean of so many values errs by chance
        chance = math.sqrt(2.0 / (3.0 * self._count)) * self._with_noise
        lagged = np.maximum(self._mean, chance)
        variance = np.square(sigma)
        total = variance + np.square(_ERROR * lagged) + np.square(chance)
        combined: np.ndarray = mean + variance / np.maximum(total, np.finfo(float).tiny) * (
            lagged - mean)
        return combined
