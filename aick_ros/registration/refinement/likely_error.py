# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""An error that a camera has or has not, by an estimate of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

PROBABILITY = 0.5  # of an error of a camera, before any registration; chosen: as likely as none

_LIKELY = 0.5
"""Probability from which on an error is corrected. By definition: it is more likely there than
not. Cameras without shutter and delay show .02 to .4."""

_CERTAIN = 0.99  # chosen: probability from which on an error is reported

_SMALLEST_SHARE = 1e-3  # of the scatter: with less the distribution is normal, to rounding


@dataclass(frozen=True)
class LikelyError:
    """
    An error that is as likely zero as not, before it is estimated.

    The probability that it is there follows by Bayes' rule: its prior density at zero by that
    after the estimate (Dickey 1971). As few groups show the scatter, the latter is Student's,
    with the degrees of freedom of Satterthwaite (1946).

    :param estimate: of an error that is there, with its prior.
    :param variance: of the estimate, by its information.
    :param scatter: of the estimate, by how far groups of data contradict each other.
    :param groups: number of those.
    :param sigma: standard deviation of the prior.
    """

    estimate: float
    variance: float
    scatter: float
    groups: int
    sigma: float

    @property
    def probability(self) -> float:
        """Probability that the error is there."""
        total = self.variance + self.scatter
        if self.groups < 2 or not math.isfinite(total):
            return PROBABILITY
        degrees = (self.groups - 1) / max(self.scatter / total, _SMALLEST_SHARE) ** 2
        fall = 0.5 * (degrees + 1) * math.log1p(self.estimate ** 2 / (degrees * total))
        height = (math.lgamma(0.5 * (degrees + 1)) - math.lgamma(0.5 * degrees)
                  - 0.5 * math.log(0.5 * degrees))
        odds = (math.log(PROBABILITY / (1.0 - PROBABILITY))
                + fall - height + 0.5 * math.log(total / self.sigma ** 2))
        return 0.5 + 0.5 * math.tanh(0.5 * odds)

    @property
    def corrected(self) -> float:
        """What is corrected: the mean, where the error is likely."""
        probability = self.probability
        return probability * self.estimate if probability > _LIKELY else 0.0

    @property
    def is_certain(self) -> bool:
        """Whether it may be said that the error is there."""
        return self.probability > _CERTAIN

    @property
    def variance_left(self) -> float:
        """Mean square of the error that is left once it is corrected."""
        probability, corrected = self.probability, self.corrected
        total = self.variance + self.scatter
        if not math.isfinite(total):
            return PROBABILITY * self.sigma ** 2
        return (probability * (total + (self.estimate - corrected) ** 2)
                + (1.0 - probability) * corrected ** 2)
