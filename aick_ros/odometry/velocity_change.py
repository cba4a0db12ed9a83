# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
By how much the velocity of a camera changes in one increment, as a mean square.

A common delay of all stamps shifts an increment by the change of the velocity. The difference of
two increments shows that change with noise, of registrations and of stamps, and as it was earlier:
between the middles of two intervals. A single difference that is small by chance would make such a
delay look harmless. So the mean over many, without their noise, has its part. Where that noise is
not known well enough, as it is larger than the change, changes over several increments count.
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry.pose import Increment, sums_along_and_about
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.lagged_change import LaggedChange

# Chosen on two excerpts of real recordings and on rendered cameras with stamps on arrival.
_MEMORY = 30  # increments that the mean is over

_CORRELATION = 0.7
"""Of the change of the velocity from frame to frame with that from interval to interval before it.
Measured: 0.45 to 0.75 on rendered cameras at 10 to 30 Hz."""

_SHORTEST = 0.5  # chosen: of an interval between acquisitions, as a ratio to that of the stamps
_STAMPS = 6.0  # by definition: sum of the squares of the factors 1, -2 and 1
_OF_STAMPS = 0.8
"""Share of the squared jitter that is the stamps'; the clock's prediction has the rest. Chosen;
0.55 to 0.85 on rendered cameras with stamps on arrival."""

_CLOCK_ERROR = 0.25  # share of the jitter that a clock with lock leaves


class VelocityChange:
    """Changes of the velocity of one camera, in time order."""

    def __init__(self) -> None:
        self._end: int | None = None  # stamp of the last increment [ns]
        self._twist = np.zeros(6)  # of it, by the times of acquisition
        self._count = 0
        self._shown, self._mean, self._noise = np.zeros(2), np.zeros(2), np.zeros(2)
        self._lagged = LaggedChange()

    def squares(self, increment: Increment, start: PreparedFrame, end: PreparedFrame,
                twist: np.ndarray) -> np.ndarray:
        """
        Return the mean squares of the change in an increment: of translation and rotation, 2.

        They are in [m^2/s^2, rad^2/s^2].

        :param increment: with the covariance of all but errors of stamps.
        :param twist: body velocity at its start, where the increment before it is another's.
        """
        interval = increment.interval + end.clock_correction - start.clock_correction
        if interval < _SHORTEST * increment.interval:  # a stamp that the clock has no image for
            interval = increment.interval
        here = increment.twist * (increment.interval / interval)
        before = twist
        if self._end == start.stamp:
            before = self._twist
        else:
            self._lagged.restart()
        change = sums_along_and_about(np.square(here - before))
        self._end, self._twist = end.stamp, here
        self._lagged.add(seconds(0, end.stamp) - 0.5 * increment.interval, here)
        return self._expected(change, _noise(increment, interval, 0.5 * (here + before), end))

    def _expected(self, shown: np.ndarray, noise: np.ndarray) -> np.ndarray:
        """Return the mean square by what is shown, what the noise of that is, and the mean."""
        self._count = min(self._count + 1, _MEMORY)
        self._shown = self._shown + (shown - self._shown) / self._count
        self._mean = self._mean + (shown - noise - self._mean) / self._count
        self._noise = self._noise + (noise - self._noise) / self._count
        # as the noise may be overestimated, no less than a standard error of three values each
        chance = math.sqrt(2.0 / (3.0 * self._count)) * self._shown
        mean = self._lagged.combined(np.maximum(self._mean, chance), np.hypot(self._noise, chance))
        weight = _CORRELATION * mean / np.maximum(mean + noise, np.finfo(float).tiny)
        expected: np.ndarray = weight ** 2 * shown + (1.0 - weight * _CORRELATION) * mean
        return expected


def _noise(increment: Increment, interval: float, twist: np.ndarray,
           end: PreparedFrame) -> np.ndarray:
    """Return the mean square of a difference of two increments by noise, of both parts, 2."""
    sigma = (end.stamp_jitter or 0.0) * (_CLOCK_ERROR if end.clock_correction else 1.0)
    # half of each of the two: biases cancel
    of_images = sums_along_and_about(np.diag(increment.pose.covariance))
    of_stamps = _STAMPS * _OF_STAMPS * sigma ** 2 * sums_along_and_about(np.square(twist))
    noise: np.ndarray = (of_images + of_stamps) / interval ** 2
    return noise
