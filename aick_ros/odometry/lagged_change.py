# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
By how much a velocity changes from interval to interval, by its change over several of them.

The change over n intervals is n times as large while it is steady, and what noise adds is not: it
has the same part in both, however large it is. So the two differ by the change.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from aick_ros.geometry.pose import sums_along_and_about

# Chosen on two excerpts of real recordings.
_LAG = 0.1  # s: a hand's change is steady for about so long
_SHORTEST = 1.8  # intervals; at lower rates the change over one is well above noise
_LONGEST = 16  # intervals that are kept
_FEWEST = 10  # changes before they are used
_MEMORY = 30  # of them that the mean is over

_STEADY = 0.7
"""Share of a change that is steady over such a time. Derived: of the square of a swing of 3 Hz."""

_ERROR = 0.5  # standard deviation of that share, as a ratio to what is found by it


class LaggedChange:
    """Changes of the velocity of one camera over several intervals, in time order."""

    def __init__(self) -> None:
        self._past = deque[tuple[float, np.ndarray]](maxlen=_LONGEST)
        self._count = 0
        self._mean, self._far = np.zeros(2), np.zeros(2)

    def add(self, time: float, twist: np.ndarray, change: np.ndarray) -> None:
        """
        Take the velocity of the next interval.

        :param time: middle of the interval [s].
        :param twist: body velocity [m/s, rad/s].
        :param change: squares of its change since the interval before, of translation and
            rotation, 2.
        """
        for then, before in self._past:
            count = (time - then) / (time - self._past[-1][0])
            if time - then <= _LAG and count >= _SHORTEST:
                self._learn(sums_along_and_about(np.square(twist - before)), change, count)
                break
        self._past.append((time, twist))

    def _learn(self, far: np.ndarray, near: np.ndarray, count: float) -> None:
        scale = _STEADY * (count ** 2 - 1.0)
        self._count = min(self._count + 1, _MEMORY)
        self._mean = self._mean + ((far - near) / scale - self._mean) / self._count
        self._far = self._far + (far / scale - self._far) / self._count

    def restart(self) -> None:
        """Forget the velocities, not the changes: the next one is not of the interval after."""
        self._past.clear()

    def combined(self, mean: np.ndarray, sigma: np.ndarray) -> np.ndarray:
        """
        Return a mean square of the change, combined with that by changes over several, 2.

        :param mean: of translation and rotation; ``sigma``: its standard deviation.
        """
        if self._count < _FEWEST:
            return mean
        chance = math.sqrt(2.0 / (3.0 * self._count)) * self._far
        lagged = np.maximum(self._mean, chance)
        weight = np.square(sigma)
        total = weight + np.square(_ERROR * lagged) + np.square(chance)
        combined: np.ndarray = mean + weight / np.maximum(total, np.finfo(float).tiny) * (
            lagged - mean)
        return combined
