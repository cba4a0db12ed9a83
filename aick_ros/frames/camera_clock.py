# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Acquisition times of images whose driver stamps them on arrival."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from aick_ros.geometry.median import SIGMA_PER_MEDIAN, median
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

# Of the loop; chosen with simulated stamps as in test_camera_clock.py:
_PHASE_GAIN = 0.1
_PERIOD_GAIN = _PHASE_GAIN ** 2 / 4  # derived: critical damping
_VARIANCE_GAIN = 0.05  # of the mean squared jitter: an exponential window of 20 stamps
_MAX_PHASE_ERROR = 0.25  # periods; stamps with a larger error are outliers
_MIN_LOCK_COUNT = 15  # inliers required before corrections are made
_MIN_STAMPS = 3  # by definition: stamps with more than one interval
MAX_SCATTER = 0.005  # s; chosen: drivers are late by less, and images on a trigger have no rate
_MISSING = np.array([2, 3, 4])  # periods; chosen: of intervals where none is of a single one
_MIN_DIVIDED = 3  # chosen: intervals required for that; two fit nearly any period
_EXACT = 0.05  # periods; chosen: deviation below which intervals are of a divided period
_MIN_JITTER_COUNT = 2  # inliers required before the jitter is measured
_OUTLIER_DECAY = 0.5  # outliers forgotten per inlier
_MAX_OUTLIERS = 3  # chosen; beyond it the lock is lost


class CameraClock:
    """
    Phase-locked loop on the stamps of a camera.

    A camera takes images at a constant rate, but most drivers stamp them when the bus delivers
    them. The loop starts as a line fitted to the stamps, then tracks phase and period through late
    stamps and missing images; without lock the stamps are left unchanged. With a jitter of up to a
    tenth of the period a quarter of it remains; with a fifth or more the loop does not lock.
    """

    def __init__(self) -> None:
        self._phase = 0.0  # time from the last stamp to the acquisition of its image [s]
        self._period = 0.0  # [s]
        self._count = 1  # inliers
        self._outliers = 0.0  # recent ones, decayed by inliers
        self._variance = 0.0  # of the stamps about the acquisition times [s^2]
        self._variance_count = 0  # stamps in the mean
        self._last: deque[int] = deque(maxlen=_MIN_LOCK_COUNT)  # stamps [ns]

    @property
    def jitter(self) -> float | None:
        """
        Standard deviation of the stamps about the acquisition times [s]; None before the third.

        Without lock it is at least what the intervals between the last stamps scatter by: stamps
        that the loop takes for outliers may be those of a camera with much jitter.
        """
        if len(self._last) < _MIN_STAMPS:
            return None
        jitter = float(self._variance ** 0.5)
        return jitter if self._is_locked else max(jitter, scatter(self._last))

    @property
    def correction(self) -> float:
        """Correction of the last stamp to the acquisition time [s]; zero without lock."""
        return self._phase if self._is_locked else 0.0

    @property
    def _is_locked(self) -> bool:
        return self._count >= _MIN_LOCK_COUNT

    def is_behind(self, stamp: int) -> bool:
        """Return whether a stamp [ns] repeats or goes back by less than ``RESTART_AFTER``."""
        return bool(self._last) and self._last[-1] - RESTART_AFTER <= stamp <= self._last[-1]

    def correct(self, stamp: int) -> float:
        """
        Update the loop and return the correction of a stamp to the acquisition time [s].

        :param stamp: [ns]; one that :meth:`is_behind` changes nothing and is not corrected.
        """
        if self.is_behind(stamp):
            return 0.0
        if self._last and stamp < self._last[-1]:
            self._last.clear()
            self._restart(0.0)
        self._last.append(stamp)
        if len(self._last) < 2:
            return 0.0
        interval = (stamp - self._last[-2]) / NANOSECONDS
        if self._period == 0.0:
            self._period = interval
        self._update(interval)
        return self.correction

    def _restart(self, period: float) -> None:
        self._phase, self._period, self._count, self._outliers = 0.0, period, 1, 0.0

    def _update(self, interval: float) -> None:
        previous = self._phase - interval  # last acquisition, relative to this stamp
        periods = round(-previous / self._period)
        error = -(previous + periods * self._period)  # this stamp after the predicted acquisition
        self._phase = -error
        is_outlier = periods == 0 or abs(error) > _MAX_PHASE_ERROR * self._period
        if self._is_locked or self._count >= _MIN_JITTER_COUNT and not is_outlier:
            self._variance_count += 1
            gain = max(_VARIANCE_GAIN, 1 / self._variance_count)
            self._variance += gain * (error ** 2 - self._variance)
        if is_outlier:
            self._outliers += 1.0
            if self._outliers >= _MAX_OUTLIERS or not self._is_locked:
                self._restart(interval)
            return
        self._outliers = max(0.0, self._outliers - _OUTLIER_DECAY)
        self._count += 1
        n = self._count  # at first the gains of the recursive least-squares line through n stamps
        self._phase += error * max(_PHASE_GAIN, (4 * n - 2) / (n * (n + 1)))
        self._period += error * max(_PERIOD_GAIN, 6 / (n * (n + 1))) / periods


def scatter(stamps: Sequence[int]) -> float:
    """
    Return the standard deviation of stamps about a constant rate, by their intervals [s].

    Robust: images may be missing, and a stamp or two may be late. It is limited, as images may
    have no rate at all.

    :param stamps: strictly increasing [ns].
    """
    if len(stamps) < _MIN_STAMPS:
        return 0.0
    intervals = np.diff(np.array(stamps, np.int64)) / NANOSECONDS
    shortest = np.sort(intervals)[(len(intervals) - 1) // 2]  # not of two, one of them double
    deviation = _deviation(intervals, shortest)
    if len(intervals) >= _MIN_DIVIDED:
        for period in shortest / _MISSING:
            divided = _deviation(intervals, period)
            if divided < min(deviation, _EXACT * period):
                deviation = divided
    sigma = SIGMA_PER_MEDIAN * deviation / math.sqrt(2)  # an interval has two stamps
    return min(sigma, MAX_SCATTER)


def _deviation(intervals: np.ndarray, period: float) -> float:
    """Return the median deviation of intervals from whole numbers of periods [s]."""
    return median(np.abs(intervals - np.rint(intervals / period) * period))
