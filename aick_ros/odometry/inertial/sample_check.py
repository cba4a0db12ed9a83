# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Choice of the samples of a gyroscope that can be used."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER, seconds

_LARGEST_RATE = 100.0  # rad/s; chosen: beyond the range of every gyroscope for cameras
_STUCK = NANOSECONDS // 2  # chosen; a coarse gyroscope at rest may measure one value for longer


class SampleCheck:
    """Drops samples that repeat or go back, are not numbers, or never change."""

    def __init__(self) -> None:
        self.dropped = 0
        """Number of samples that could not be used."""
        self._last: int | None = None
        self._rate = np.full(3, np.nan)
        self._unchanged_since = 0

    @property
    def unchanged(self) -> str:
        """The value that is unchanged for half a second, in words; '' where there is none."""
        if self._last is None or self._last - self._unchanged_since <= _STUCK:
            return ''
        x, y, z = self._rate
        return (f'the gyroscope has reported ({x:g}, {y:g}, {z:g}) rad/s for '
                f'{seconds(self._unchanged_since, self._last):.1f} s')

    def usable(self, samples: ImuSamples) -> Iterator[tuple[int, np.ndarray]]:
        """Yield stamp [ns] and turn rate, 3 [rad/s], of the samples that can be used."""
        measured = ~np.isnan(samples.turn_rates).all(axis=1)
        # comparisons with NaN are false
        sensible = (np.abs(samples.turn_rates) <= _LARGEST_RATE).all(axis=1)
        self.dropped += int(np.count_nonzero(measured & ~sensible))
        for stamp, rate in zip(samples.stamps[sensible].tolist(), samples.turn_rates[sensible]):
            if self._last is not None and 0 <= self._last - stamp <= RESTART_AFTER:
                self.dropped += 1
                continue
            if not np.array_equal(rate, self._rate) or self._last is None or stamp < self._last:
                self._rate, self._unchanged_since = rate, stamp
            self._last = stamp
            yield stamp, rate
