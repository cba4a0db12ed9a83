# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors that a camera has or has not, by estimates of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

PROBABILITY = 0.5  # of an error of a camera, before any registration; chosen: as likely as none

_LIKELY = 0.55
"""Probability from which on errors are corrected: they are more likely there than not, by more
than the tails of Student's distribution make it where data show nothing."""

_FEWEST = 3  # groups of data; the scatter of two is too often small by chance

_CERTAIN = 0.99  # chosen: probability from which on errors are reported

_TOGETHER = 0.8  # chosen: probability of each error of a camera that has some

_LARGEST_ODDS = 100.0  # logarithm; larger ones are as good

_SMALLEST_SHARE = 1e-3
"""Of an estimate that is by data, and of its variance that is by scatter: with less of the former
nothing is known, with less of the latter the distribution is normal."""


def probability_by(odds: float) -> float:
    """
    Return the probability of an error of a camera, by Bayes' rule.

    :param odds: logarithm of those that data give to it, against none.
    """
    return 0.5 + 0.5 * math.tanh(0.5 * (odds + math.log(PROBABILITY / (1.0 - PROBABILITY))))


@dataclass(frozen=True)
class LikelyError:
    """
    What data show of an error that may be there or not.

    The odds that it is there follow by Bayes' rule: its prior density at zero by that after the
    estimate (Dickey 1971). As few groups show the scatter, the latter is Student's, with the
    degrees of freedom of Satterthwaite (1946).

    :param groups: number of groups of data that show the scatter.
    :param sigma: standard deviation of an error that is there.
    :param mean: of it by the data, if it is there; ``variance``: of it.
    :param scatter: share of the variance of the data that only the scatter of groups shows.
    """

    groups: int
    sigma: float
    mean: float
    variance: float
    scatter: float

    @classmethod
    def of(cls, estimate: float, variance: float, scatter: float, groups: int,
           sigma: float) -> LikelyError:
        """
        Return one by an estimate that may scatter by more than its variance.

        The estimate is freed of its prior, has the larger variance of the two, and then the prior
        again.

        :param estimate: of an error that is there, with its prior.
        :param variance: of the estimate, by its information and that of the prior.
        :param scatter: variance of the estimate by how far groups of data contradict each other.
        """
        prior = sigma ** 2
        share = 1.0 - variance / prior if math.isfinite(variance) else 0.0
        if groups < _FEWEST or share < _SMALLEST_SHARE or not math.isfinite(scatter):
            return cls(groups, sigma, 0.0, prior, 0.0)
        known = variance / share
        noise = max(known, scatter / share ** 2)
        return cls(groups, sigma, estimate / share * prior / (prior + noise),
                   prior * noise / (prior + noise), 1.0 - known / noise)

    @property
    def _degrees(self) -> float:
        """Degrees of freedom of the variance."""
        return max(self.groups - 1, 1) / max(self.scatter, _SMALLEST_SHARE) ** 2

    @property
    def spread(self) -> float:
        """Variance of the error about the mean: larger, as few groups show the scatter."""
        degrees, prior = self._degrees, self.sigma ** 2
        return min(self.variance * degrees / (degrees - 2.0), prior) if degrees > 2.0 else prior

    @property
    def odds(self) -> float:
        """Logarithm of the odds that data give to an error that is there, against none."""
        degrees = self._degrees
        fall = 0.5 * (degrees + 1) * math.log1p(self.mean ** 2 / (degrees * self.variance))
        height = (math.lgamma(0.5 * (degrees + 1)) - math.lgamma(0.5 * degrees)
                  - 0.5 * math.log(0.5 * degrees))
        return fall - height + 0.5 * math.log(self.variance / self.sigma ** 2)


@dataclass(frozen=True)
class LikelyErrors:
    """
    Errors that come together, as the delay and the readouts of a rolling shutter.

    A camera without any is as likely as one with some; one that has some has each of them with a
    probability. So one that is certain makes the others likely: it may be worse than none alone.
    """

    errors: Sequence[LikelyError]

    @property
    def probability(self) -> float:
        """Probability that there are any; the estimates count as independent."""
        return probability_by(
            sum(math.log(1.0 - _TOGETHER + _TOGETHER * ratio) for ratio in self._ratios))

    @property
    def probabilities(self) -> np.ndarray:
        """Probability of each, N."""
        there = _TOGETHER * self._ratios
        probabilities: np.ndarray = self.probability * there / (1.0 - _TOGETHER + there)
        return probabilities

    @property
    def _ratios(self) -> np.ndarray:
        return np.array([math.exp(min(error.odds, _LARGEST_ODDS)) for error in self.errors])

    @property
    def are_certain(self) -> np.ndarray:
        """Certainty of each, with which it is reported, N."""
        certain: np.ndarray = self.probabilities > _CERTAIN
        return certain

    @property
    def corrected(self) -> np.ndarray:
        """Correction of each, N: its mean over both cases, where any are likely."""
        if self.probability <= _LIKELY:
            return np.zeros(len(self.errors))
        means: np.ndarray = self.probabilities * [error.mean for error in self.errors]
        return means

    @property
    def variances_left(self) -> np.ndarray:
        """Mean squares of what is left of each once they are corrected, N."""
        probabilities, corrected = self.probabilities, self.corrected
        means, spreads = np.array([(error.mean, error.spread) for error in self.errors]).T
        left: np.ndarray = (probabilities * (spreads + np.square(means - corrected))
                            + (1.0 - probabilities) * np.square(corrected))
        return left
