# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Number of missing images of a stream, estimated from the gaps between their stamps."""

from __future__ import annotations

from bisect import bisect_left

import numpy as np

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER

_LONGEST_GAP = NANOSECONDS  # [ns], chosen; a longer gap is a pause, not a loss
_RECENT = 100  # gaps, chosen: about 3 s at 30 Hz
_BLOCK = 50  # gaps whose count becomes final together; chosen, costs only memory
_FEWEST_GAPS = 20  # chosen; fewer do not show the period
_PERIOD_TOLERANCE = 0.1  # relative difference of gaps of one period; chosen
# A ratio of gap to period is unclear where it is further than this from a whole number. Where the
# share of unclear ratios is larger than the second number, nothing is counted. Both chosen.
_UNCLEAR, _LARGEST_UNCLEAR_SHARE = 0.25, 0.2
_LARGEST_MEAN_PERIODS = 10.0  # of a gap; chosen: beyond it, the period itself is in doubt
_STEADY = 8  # equal gaps in a row, chosen: the camera has changed its rate, and nothing is lost
_UNSETTLED = _STEADY  # newest gaps, which late images may still fill, or which may become steady


class MissingImages:
    """Counts the images that are missing between the stamps of one stream."""

    def __init__(self) -> None:
        self._stamps: list[int] = []  # the most recent ones, increasing [ns]
        self._settled = self._count = 0

    def add(self, stamp: int) -> None:
        """Add the stamp of an image that arrived [ns]; late ones are sorted in."""
        if self._stamps and self._stamps[-1] - stamp > RESTART_AFTER:
            self._settle(len(self._stamps))
        index = bisect_left(self._stamps, stamp)
        if index == len(self._stamps) or self._stamps[index] != stamp:
            self._stamps.insert(index, stamp)
        if len(self._stamps) > _RECENT + _BLOCK:
            self._settle(_BLOCK)

    @property
    def count(self) -> int:
        """Number of missing images so far; it never decreases."""
        settled = self._periods()[:-_UNSETTLED]
        self._count = max(self._count, self._settled + _surplus(settled))
        return self._count

    @property
    def share(self) -> float:
        """Share of missing images in the last 100 settled gaps, from 0 to 1."""
        periods = self._periods()[:-_UNSETTLED][-_RECENT:]
        return max(0.0, float(_surplus(periods) / periods.sum())) if periods.any() else 0.0

    def _settle(self, count: int) -> None:
        """Make the count of the oldest gaps final, and forget their stamps."""
        self._settled += _surplus(self._periods()[:count])
        del self._stamps[:count]

    def _periods(self) -> np.ndarray:
        """
        Return the number of camera periods in each recent gap, N int; all ones where unclear.

        An image stamped late has a long gap before it and short ones, of zero periods, after it.
        Where stamps jitter by much of a period, the missing images between them are not
        countable. Many equal gaps in a row are those of a camera at another rate: images that
        are lost leave gaps of different lengths.
        """
        gaps = np.diff(np.array(self._stamps, np.int64))
        if len(gaps) < _FEWEST_GAPS:
            return np.ones(len(gaps), int)
        # one period is the most frequent gap, however many images are lost
        similar = np.abs(gaps[:, None] - gaps) <= _PERIOD_TOLERANCE * gaps[:, None]
        ratios = gaps / np.median(gaps[similar[similar.sum(axis=1).argmax()]])
        ratios[gaps > _LONGEST_GAP] = 1.0
        periods: np.ndarray = np.rint(ratios).astype(int)
        steady = _steady(gaps)
        unclear = np.mean((np.abs(ratios - periods) > _UNCLEAR) & ~steady) > _LARGEST_UNCLEAR_SHARE
        periods[steady] = 1
        if unclear or periods.mean() > _LARGEST_MEAN_PERIODS:
            return np.ones(len(gaps), int)
        return periods


def _steady(gaps: np.ndarray) -> np.ndarray:
    """Return which gaps are among many similar ones in a row, N bool."""
    changes = np.abs(np.diff(gaps)) > _PERIOD_TOLERANCE * gaps[:-1]
    starts = np.concatenate([[0], np.flatnonzero(changes) + 1, [len(gaps)]])
    lengths = np.diff(starts)
    steady: np.ndarray = np.repeat(lengths >= _STEADY, lengths)
    return steady


def _surplus(periods: np.ndarray) -> int:
    """Return by how much the number of periods exceeds the number of gaps."""
    return int((periods - 1).sum())
