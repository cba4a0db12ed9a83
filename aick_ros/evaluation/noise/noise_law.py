# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How a noise grows with something: a power law through the medians of many samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.noise.power_law import fit_exponent, fit_scale
from aick_ros.settings.parameter import Parameter

LEAST_SAMPLES = 30
"""Of a bin."""

_BINS = 4  # each time what the noise grows with doubles
_MOST_SAMPLES = 300  # of a bin, that count: beyond it is not their number that a bin is off by
_LEAST_SPAN = 2.0  # last by first bin: less, and chance decides on the exponent
_LEAST_BINS = 4


@dataclass(frozen=True)
class Bin:
    """
    Samples of about the same place.

    :param at: mean of what the noise grows with.
    :param count: how many.
    :param sigma: their median.
    """

    at: float
    count: int
    sigma: float


@dataclass(frozen=True)
class NoiseLaw:
    """
    The law sigma = scale * x ^ exponent.

    :param exponent_estimated: False where the bins span too little, and the one given was kept.
    :param bins: with enough samples, by x.
    """

    scale: float
    exponent: float
    exponent_estimated: bool
    bins: Sequence[Bin]

    def at(self, x: float) -> float:
        """Return the standard deviation at some place."""
        return self.scale * x ** self.exponent


def bins_of(x: np.ndarray, sigmas: np.ndarray) -> list[Bin]:
    """
    Return the bins that have enough samples, by x.

    :param x: N > 0, what the noise grows with.
    :param sigmas: N, standard deviations, each as one sample has it.
    """
    found = []
    numbers = np.rint(_BINS * np.log2(x)).astype(np.intp)
    for number in np.unique(numbers):
        inside = numbers == number
        if inside.sum() >= LEAST_SAMPLES:
            found.append(Bin(float(np.exp(np.log(x[inside]).mean())), int(inside.sum()),
                             float(np.median(sigmas[inside]))))
    return found


def fit_law(bins: Sequence[Bin], exponent: Parameter) -> NoiseLaw:
    """
    Fit the law to one or more bins.

    :param exponent: its range, and as its default what is kept where the bins span too little.
    """
    x, counts, sigmas = np.array([(bin_.at, bin_.count, bin_.sigma) for bin_ in bins]).T
    weights = np.minimum(counts, _MOST_SAMPLES)
    told = bool(len(bins) >= _LEAST_BINS and x[-1] >= _LEAST_SPAN * x[0])
    power = exponent.default
    if told:
        power = min(max(fit_exponent(x, sigmas, weights), exponent.minimum), exponent.maximum)
    return NoiseLaw(fit_scale(x, sigmas, weights, power), power, told, bins)
