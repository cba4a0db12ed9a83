# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Choice of the samples of a sensor that can be used."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER, seconds

_STUCK = NANOSECONDS // 2  # chosen; a coarse sensor at rest may measure one value for longer


class SampleCheck:
    """
    Drops samples that repeat or go back, are not numbers, or never change.

    :param name: of the sensor.
    :param unit: of its values.
    :param largest: value that can be right.
    """

    def __init__(self, name: str, unit: str, largest: float) -> None:
        self._name, self._unit, self._largest = name, unit, largest
        self.dropped = 0
        """Number of samples that could not be used."""
        self._last: int | None = None
        self.value = np.full(3, np.nan)
        """The last value that was used, 3; NaN where there is none."""
        self.unchanged_since = 0
        """Stamp of the first sample that has this value, as all after it [ns]."""

    @property
    def unchanged(self) -> str:
        """The value that is unchanged for half a second, in words; '' where there is none."""
        if self._last is None or self._last - self.unchanged_since <= _STUCK:
            return ''
        x, y, z = self.value
        return (f'the {self._name} has reported ({x:g}, {y:g}, {z:g}) {self._unit} for '
                f'{seconds(self.unchanged_since, self._last):.1f} s')

    def is_unchanged_since(self, stamp: int) -> bool:
        """Return whether the value is :attr:`unchanged`, and was the same at a stamp [ns]."""
        return bool(self.unchanged) and self.unchanged_since <= stamp

    def was_unchanged_at(self, stamp: int) -> bool:
        """Return whether a sample with the last value is at a stamp [ns] or on each side of it."""
        return self._last is not None and self.unchanged_since <= stamp <= self._last

    def usable(self, stamps: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """
        Return stamps [ns] and values, Nx3, of the samples that can be used.

        :param stamps: N int64.
        :param values: Nx3; NaN where the sensor has not measured.
        """
        if not np.abs(values).max(initial=0.0) <= self._largest:  # or NaN
            sensible = self._sensible(values)
            stamps, values = stamps[sensible], values[sensible]
        if not len(stamps):
            return stamps, values
        if not self._are_ordered(stamps):
            ordered = self._ordered(stamps)
            self.dropped += int(np.count_nonzero(~ordered))
            stamps, values = stamps[ordered], values[ordered]
        if len(stamps):
            self._note(stamps, values)
        return stamps, values

    def _sensible(self, values: np.ndarray) -> np.ndarray:
        """Return which values can be right."""
        missing = np.isnan(values)
        if missing.all():
            return np.zeros(len(values), bool)
        sensible: np.ndarray = (np.abs(values) <= self._largest).all(axis=1)
        self.dropped += int(np.count_nonzero(~sensible & ~missing.all(axis=1)))
        return sensible

    def _are_ordered(self, stamps: np.ndarray) -> bool:
        """Return whether no sample repeats or goes back."""
        return ((self._last is None or int(stamps[0]) > self._last)
                and bool((stamps[1:] > stamps[:-1]).all()))

    def _ordered(self, stamps: np.ndarray) -> np.ndarray:
        """Return which samples neither repeat nor go back, or are those of a restart."""
        last, ordered = self._last, []
        for stamp in stamps.tolist():
            ordered.append(last is None or not 0 <= last - stamp <= RESTART_AFTER)
            last = stamp if ordered[-1] else last
        return np.array(ordered, bool)

    def _note(self, stamps: np.ndarray, values: np.ndarray) -> None:
        """Note since when the value is that of the last sample."""
        before = np.concatenate([self.value[None], values[:-1]])
        changes = values != before
        changes[1:] |= (stamps[1:] < stamps[:-1])[:, None]
        changes[0] |= self._last is None or int(stamps[0]) < self._last
        changed = np.flatnonzero(changes) // 3  # values of each sample
        if len(changed):
            self.unchanged_since = int(stamps[changed[-1]])
        self.value, self._last = values[-1], int(stamps[-1])
