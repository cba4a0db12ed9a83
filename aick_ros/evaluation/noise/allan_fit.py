# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Noise density and random walk of the bias that an Allan variance shows (IEEE 952).

White noise of density N and a bias that walks with density K have the Allan variance

    N^2 / t + K^2 t / 3

at an averaging time t. It is linear in both squares, and each variance measured has a chi-square
distributed error, so that the most likely squares solve a weighted linear problem.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.noise.allan_variance import AllanVariance

_SHORTEST = 0.1  # s; chosen: filters in the sensors smooth what is faster
_ITERATIONS = 20  # chosen
_NORMAL_95 = 1.96  # derived: half of the 95 % interval of a normal distribution, by its sigma
_SIGNIFICANT = 3.0  # chosen

_SHARED = np.array([1.0, 2.0])
"""
Factors of the covariance of noise and walk, as averaging times share the course of a walk.

Measured on simulated sensors whose walk shows after 6 s to 3 min.
"""


@dataclass(frozen=True)
class Estimate:
    """
    A density with its 95 % interval.

    :param value: None where the recording does not determine it; it is below ``high``.
    """

    value: float | None
    low: float
    high: float


@dataclass(frozen=True)
class NoiseDensities:
    """
    Noise of a sensor, the mean of its axes.

    :param noise: density of the white noise [unit/sqrt(Hz)].
    :param bias_walk: random walk of the bias [unit/s/sqrt(Hz)].
    """

    noise: Estimate
    bias_walk: Estimate

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the Allan variances at some averaging times [s]."""
        squares = np.square([self.noise.value or 0.0, self.bias_walk.value or 0.0])
        variances: np.ndarray = _terms(times) @ squares
        return variances


def fit_densities(measured: AllanVariance) -> NoiseDensities:
    """Return the most likely densities of all axes together."""
    used = measured.times >= _SHORTEST
    terms = _terms(measured.times[used])
    variances = measured.variances[used].mean(axis=1)
    weights = measured.degrees_of_freedom[used] * measured.variances.shape[1] / 2.0
    squares = np.array([variances[0] / terms[0, 0], 0.0])
    for _ in range(_ITERATIONS):
        scaled = terms * (np.sqrt(weights) / (terms @ squares))[:, None]
        target = variances * np.sqrt(weights) / (terms @ squares)
        squares = _not_negative(scaled, target)
    sigmas = np.sqrt(_SHARED * np.diag(np.linalg.inv(scaled.T @ scaled)))
    noise, walk = (_estimate(float(square), float(sigma))
                   for square, sigma in zip(squares, sigmas))
    return NoiseDensities(noise, walk)


def _terms(times: np.ndarray) -> np.ndarray:
    """Return the Allan variances of unit densities at T times [s], Tx2."""
    return np.column_stack([1.0 / times, times / 3.0])


def _not_negative(rows: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the two factors, neither negative, that fit best."""
    both: np.ndarray = np.linalg.lstsq(rows, target, rcond=None)[0]
    if (both > 0.0).all():
        return both
    alone = rows.T @ target / np.square(rows).sum(axis=0)
    # white noise is always there, a walk too slow to be seen
    return np.array([0.0, alone[1]]) if both[0] <= 0.0 else np.array([alone[0], 0.0])


def _estimate(square: float, sigma: float) -> Estimate:
    """Return a density by its square and the standard deviation of that."""
    if square < _SIGNIFICANT * sigma:
        return Estimate(None, 0.0, float(np.sqrt(square + _NORMAL_95 * sigma)))
    factor = float(np.exp(0.5 * _NORMAL_95 * sigma / square))
    value = float(np.sqrt(square))
    return Estimate(value, value / factor, value * factor)
