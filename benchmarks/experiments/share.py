# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A share of many trials with its confidence interval."""

from __future__ import annotations

import math
from dataclasses import dataclass

_DEVIATIONS = 1.96  # of a normal distribution, between which 95 % of it lie


@dataclass(frozen=True)
class Share:
    """So many successes of so many trials."""

    successes: int
    trials: int

    @property
    def value(self) -> float:
        """The share itself."""
        return self.successes / self.trials

    @property
    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the share of independent trials (Wilson 1927)."""
        squares = _DEVIATIONS ** 2 / self.trials
        middle = (self.value + squares / 2) / (1 + squares)
        spread = math.sqrt(self.value * (1 - self.value) / self.trials * _DEVIATIONS ** 2
                           + squares ** 2 / 4) / (1 + squares)
        return middle - spread, middle + spread

    def __str__(self) -> str:
        """Return the share with its interval."""
        low, high = self.interval
        return f'{self.value:.2f} ({low:.2f} to {high:.2f})'
