# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Power law of a standard deviation, fitted to the medians of binned samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.noise.power_law import fit_exponent, fit_scale
from aick_ros.settings.parameter import Parameter

MIN_SAMPLES = 30  # chosen
"""Minimum number of samples in a bin."""

_BINS_PER_OCTAVE = 4  # chosen
_SATURATION = 300  # samples beyond which the weight of a bin no longer grows; chosen
_MIN_SPAN = 2.0  # ratio of the last bin to the first that determines the exponent; chosen
_MIN_BINS = 4  # number of bins that determines the exponent; chosen


@dataclass(frozen=True)
class Bin:
    """
    Samples at about the same x.

    :param at: geometric mean of x.
    :param count: number of samples.
    :param sigma: median of their standard deviations.
    """

    at: float
    count: int
    sigma: float


@dataclass(frozen=True)
class NoiseLaw:
    """
    Power law sigma = scale * x ^ exponent.

    :param exponent_estimated: False where the range of x is too small, and the default was kept.
    :param bins: bins with enough samples, by x.
    """

    scale: float
    exponent: float
    exponent_estimated: bool
    bins: Sequence[Bin]

    def at(self, x: float) -> float:
        """Return the standard deviation at x."""
        return float(self.scale * x ** self.exponent)


def bins_of(x: np.ndarray, sigmas: np.ndarray) -> list[Bin]:
    """
    Return the bins with enough samples, by x.

    :param x: N, positive.
    :param sigmas: standard deviation of each sample, N.
    """
    found = []
    numbers = np.rint(_BINS_PER_OCTAVE * np.log2(x)).astype(np.intp)
    for number in np.unique(numbers):
        inside = numbers == number
        if inside.sum() >= MIN_SAMPLES:
            found.append(Bin(float(np.exp(np.log(x[inside]).mean())), int(inside.sum()),
                             float(np.median(sigmas[inside]))))
    return found


def fit_law(bins: Sequence[Bin], default_exponent: float, declared: Parameter) -> NoiseLaw:
    """
    Fit the power law to one or more bins.

    :param default_exponent: kept where the range of x is too small to estimate the exponent.
    :param declared: declaration of the exponent, to whose range it is limited.
    """
    x, counts, sigmas = np.array([(bin_.at, bin_.count, bin_.sigma) for bin_ in bins]).T
    weights = np.minimum(counts, _SATURATION)
    is_estimated = bool(len(bins) >= _MIN_BINS and x[-1] >= _MIN_SPAN * x[0])
    exponent = default_exponent
    if is_estimated:
        exponent = float(np.clip(fit_exponent(x, sigmas, weights),
                                 declared.minimum, declared.maximum))
    return NoiseLaw(fit_scale(x, sigmas, weights, exponent), exponent, is_estimated, bins)
