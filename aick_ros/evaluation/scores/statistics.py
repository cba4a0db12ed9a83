# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Figures that may not exist: None, never NaN, so that they can be written as JSON."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Percentiles:
    """Median and 99th percentile; None of no values."""

    p50: float | None
    p99: float | None

    @classmethod
    def of(cls, values: Iterable[float]) -> Percentiles:
        """Return the percentiles of some values, between two of them interpolated."""
        values = np.fromiter(values, np.float64)
        if len(values) == 0:
            return cls(None, None)
        return cls(*(float(p) for p in np.percentile(values, (50, 99))))


def mean(values: Iterable[float]) -> float | None:
    """Return the mean, None of no values."""
    values = np.fromiter(values, np.float64)
    return float(values.mean()) if len(values) else None


def median(values: Iterable[float]) -> float | None:
    """Return the median, None of no values and where it is infinite."""
    values = np.sort(np.fromiter(values, np.float64))
    if len(values) == 0 or not np.isfinite(values[len(values) // 2]):
        return None
    return float(np.median(values))


def root_mean_square(values: Iterable[float]) -> float | None:
    """Return the root of the mean square, None of no values."""
    values = np.fromiter(values, np.float64)
    return float(np.sqrt(np.mean(values ** 2))) if len(values) else None
