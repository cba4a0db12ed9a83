# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the stamps of a stream of images tell: which are astray, and how many are missing."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

_FAR = 10 * NANOSECONDS  # ahead of what the time that has passed explains
_LONGEST_GAP = NANOSECONDS  # a longer one is a pause, not a loss
_LATELY = 100  # gaps
_BLOCK = 50  # gaps that are settled at once
_FEWEST_GAPS = 20
_ALIKE = 0.1  # how far gaps of one period may be apart, as a share
_OFF, _FEWEST_OFF = 0.25, 0.2  # gaps that are no whole number of periods; from which share on
_MOST_PERIODS = 10.0  # of a gap on average; if nine of ten images are lost, nothing is told
_UNSETTLED = 5  # of the newest gaps, into which late images may still come


class StampMonitor:
    """Watches the stamps of one stream as they arrive."""

    def __init__(self) -> None:
        self._last: tuple[int, float] | None = None
        self._ahead: int | None = None
        self._stamps: list[int] = []  # of late, increasing
        self._settled = self._missing = 0

    def is_astray(self, stamp: int, now: float) -> bool:
        """
        Whether a stamp is far ahead of its stream, and alone: if the next is there too, it is not.

        One message stamped in the future would have consumers of TF refuse all that follow.

        :param stamp: [ns].
        :param now: steady time [s].
        """
        if self._last is not None:
            passed = round((now - self._last[1]) * NANOSECONDS)
            alone = self._ahead is None or not 0 <= stamp - self._ahead <= _FAR
            if stamp - self._last[0] - passed > _FAR and alone:
                self._ahead = stamp
                return True
        self._last, self._ahead = (stamp, now), None
        self._remember(stamp)
        return False

    @property
    def missing(self) -> int:
        """How many images left a gap instead, as far as the gaps tell; it never falls."""
        settled = self._periods()[:-_UNSETTLED]
        self._missing = max(self._missing, self._settled + _surplus(settled))
        return self._missing

    @property
    def missing_share(self) -> float:
        """Their share in the images lately."""
        periods = self._periods()[-_LATELY:]
        return max(0.0, float(_surplus(periods) / periods.sum())) if periods.any() else 0.0

    def _remember(self, stamp: int) -> None:
        if self._stamps and self._stamps[-1] - stamp > RESTART_AFTER:
            self._settle(len(self._stamps) - 1)
            self._stamps.clear()
        place = bisect_left(self._stamps, stamp)  # an image that comes late fills its gap
        if place == len(self._stamps) or self._stamps[place] != stamp:
            self._stamps.insert(place, stamp)
        if len(self._stamps) > _LATELY + _BLOCK:
            self._settle(_BLOCK)

    def _settle(self, count: int) -> None:
        """Count what is missing in the oldest gaps for good."""
        self._settled += _surplus(self._periods()[:count])
        del self._stamps[:count]

    def _periods(self) -> np.ndarray:
        """
        Return how many periods of the camera each gap lately was; one each where that is unclear.

        An image stamped late leaves a long gap before it and short ones, of no period, behind.
        Stamps that jitter by much of a period do not tell what is missing between them.
        """
        gaps = np.diff(np.array(self._stamps, np.int64))
        if len(gaps) < _FEWEST_GAPS:
            return np.ones(len(gaps), int)
        # however many images are lost, no number of periods is as frequent as one
        alike = np.abs(gaps[:, None] - gaps) <= _ALIKE * gaps[:, None]
        ratios = gaps / np.median(gaps[alike[alike.sum(axis=1).argmax()]])
        ratios[gaps > _LONGEST_GAP] = 1.0
        periods = np.rint(ratios).astype(int)
        unclear = np.mean(np.abs(ratios - periods) > _OFF) > _FEWEST_OFF
        if unclear or periods.mean() > _MOST_PERIODS:
            return np.ones(len(gaps), int)
        return periods


def _surplus(periods: np.ndarray) -> int:
    """Return how many periods more there are than gaps."""
    return int((periods - 1).sum())
