# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What the stamps of a stream of images tell: which are astray, and how many are missing."""

from __future__ import annotations

from collections import deque

import numpy as np

from aick_ros.trajectory import NANOSECONDS

_FAR = 10 * NANOSECONDS  # ahead of what the time that has passed explains
_LONGEST_GAP = NANOSECONDS  # a longer one is a pause, not a loss
_GAPS_KEPT = 100
_FEWEST_GAPS = 20
_ALIKE = 0.4  # how far gaps of one period may be off it, in periods
_OFF, _FEWEST_OFF = 0.25, 0.2  # gaps that are no whole number of periods; from which share on
_MOST_PERIODS = 10.0  # of a gap on average; if nine of ten images are lost, nothing is told
_SETTLED_AFTER = 5  # images after which one that comes late has come


class StampWatch:
    """Watches the stamps of one stream as they arrive."""

    def __init__(self) -> None:
        self._last: tuple[int, float] | None = None
        self._ahead: int | None = None
        self._gaps: deque[int] = deque(maxlen=_GAPS_KEPT)
        self._missed = self._missing = 0
        self._lately: deque[int] = deque(maxlen=_SETTLED_AFTER)

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
            if 0 < stamp - self._last[0] <= _LONGEST_GAP:
                self._gaps.append(stamp - self._last[0])
                self._count()
        self._last, self._ahead = (stamp, now), None
        return False

    @property
    def missing(self) -> int:
        """How many images left a gap instead, as far as the gaps tell."""
        return self._missing

    @property
    def missing_share(self) -> float:
        """Their share in the images lately."""
        periods = self._periods()
        return max(0.0, float(1.0 - len(periods) / periods.sum())) if len(periods) else 0.0

    def _count(self) -> None:
        periods = self._periods()
        # the first gaps can be told only now
        untold = periods if len(periods) == _FEWEST_GAPS else periods[-1:]
        self._missed += int((untold - 1).sum())
        self._lately.append(self._missed)
        self._missing = max(self._missing, min(self._lately))

    def _periods(self) -> np.ndarray:
        """
        Return how many periods of the camera each gap lately was; one each where that is unclear.

        An image stamped late leaves a long gap before it and a short one, of no period, behind.
        Stamps that jitter by much of a period do not tell what is missing between them.
        """
        gaps = np.array(self._gaps)
        if len(gaps) < _FEWEST_GAPS:
            return np.ones(len(gaps), int)
        # most images may be lost, but some follow each other; fewer come in the wake of a late one
        shortest = np.sort(gaps)[len(gaps) // 7]
        ratios = gaps / np.median(gaps[np.abs(gaps - shortest) <= _ALIKE * shortest])
        periods = np.rint(ratios).astype(int)
        unclear = np.mean(np.abs(ratios - periods) > _OFF) > _FEWEST_OFF
        if unclear or periods.mean() > _MOST_PERIODS:  # then the shortest is none
            return np.ones(len(gaps), int)
        return periods
