# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Choice of the samples of a sensor that can be used."""

from __future__ import annotations

from collections.abc import Iterator

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
        self._value = [np.nan] * 3
        self._unchanged_since = 0

    @property
    def unchanged(self) -> str:
        """The value that is unchanged for half a second, in words; '' where there is none."""
        if self._last is None or self._last - self._unchanged_since <= _STUCK:
            return ''
        x, y, z = self._value
        return (f'the {self._name} has reported ({x:g}, {y:g}, {z:g}) {self._unit} for '
                f'{seconds(self._unchanged_since, self._last):.1f} s')

    def usable(self, stamps: np.ndarray, values: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        """
        Yield stamp [ns] and value, 3, of the samples that can be used.

        :param stamps: N int64.
        :param values: Nx3; NaN where the sensor has not measured.
        """
        measured = ~np.isnan(values).all(axis=1)
        # comparisons with NaN are false
        sensible = (np.abs(values) <= self._largest).all(axis=1)
        self.dropped += int(np.count_nonzero(measured & ~sensible))
        rows = values[sensible]
        for stamp, value, numbers in zip(stamps[sensible].tolist(), rows, rows.tolist()):
            if self._last is not None and 0 <= self._last - stamp <= RESTART_AFTER:
                self.dropped += 1
                continue
            if numbers != self._value or self._last is None or stamp < self._last:
                self._value, self._unchanged_since = numbers, stamp
            self._last = stamp
            yield stamp, value
