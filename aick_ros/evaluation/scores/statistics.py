# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Statistics of lists that may be empty: None, never NaN, which JSON does not have."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Percentiles:
    """Median and 99th percentile; None without values."""

    p50: float | None
    p99: float | None

    @classmethod
    def of(cls, values: Iterable[float]) -> Percentiles:
        """Return the percentiles of some values, linearly interpolated."""
        array = np.fromiter(values, np.float64)
        if len(array) == 0:
            return cls(None, None)
        return cls(*(float(p) for p in np.percentile(array, (50, 99))))


def mean(values: Iterable[float]) -> float | None:
    """Return the mean; None without values."""
    array = np.fromiter(values, np.float64)
    return float(array.mean()) if len(array) else None


def median(values: Iterable[float]) -> float | None:
    """Return the median; None without values and where it is infinite."""
    array = np.sort(np.fromiter(values, np.float64))
    if len(array) == 0 or not np.isfinite(array[len(array) // 2]):
        return None
    return float(np.median(array))


def root_mean_square(values: Iterable[float]) -> float | None:
    """Return the root mean square; None without values."""
    array = np.fromiter(values, np.float64)
    return float(np.sqrt(np.mean(array ** 2))) if len(array) else None
