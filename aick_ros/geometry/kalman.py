# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Kalman filter: what a linear measurement changes in an estimate, and what time does."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.geometry import definite

LARGEST_SQUARED_DISTANCES = {3: 16.27, 6: 22.46, 12: 32.91}
"""Of so many values measured from those expected, by their covariance.

Derived: noise exceeds it in one of a thousand updates, by the chi-squared distribution."""


@dataclass(frozen=True, eq=False)
class KalmanUpdate:
    """
    Update of an estimate of N values by K linear measurements of them.

    :param expected: KxK, covariance of the measurement less the estimate.
    :param gain: NxK; times that difference it is the change of the estimate.
    :param kept: NxN, share of the errors of the estimate that is left.
    :param covariance: NxN, of the estimate afterwards.
    """

    expected: np.ndarray
    gain: np.ndarray
    kept: np.ndarray
    covariance: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, rows: np.ndarray, noise: np.ndarray) -> KalmanUpdate:
        """
        Return the update of an estimate.

        :param covariance: NxN, of the estimate before.
        :param rows: KxN, derivatives of what is measured by the values.
        :param noise: KxK, covariance of the measurements.
        """
        size, count = len(covariance), len(noise)
        expected, gain = np.empty((count, count)), np.empty((size, count))
        kept, updated = np.empty((2, size, size))
        if not kernels.kalman_update(covariance, rows, noise, expected, gain, kept, updated):
            gain = np.linalg.solve(expected, rows @ covariance).T
            kept = np.eye(size) - gain @ rows
            updated = propagated(kept, covariance, gain, noise)
        return cls(expected, gain, kept, updated)

    def squared_distance(self, error: np.ndarray) -> float:
        """Return the square of a difference, K, by its covariance; noise gives K in the mean."""
        return float(error @ definite.solve(self.expected, error))


def measured(values: np.ndarray, covariance: np.ndarray, rows: np.ndarray, noise: np.ndarray,
             error: np.ndarray, largest: float = math.inf) -> tuple[np.ndarray, np.ndarray] | None:
    """
    Return an estimate of N values and its covariance, NxN, after K linear measurements of them.

    :param rows: KxN, derivatives of what is measured by the values.
    :param noise: KxK, covariance of the measurements.
    :param error: K, the measurements less what the estimate lets expect.
    :param largest: squared distance of the error by its covariance from which on, and where it
        has none, the measurement is no noise: then there is no estimate.
    """
    updated, updated_covariance = np.empty(len(values)), np.empty(covariance.shape)
    is_noise = kernels.kalman_measurement(
        values, covariance, rows, noise, error, largest, updated, updated_covariance)
    return (updated, updated_covariance) if is_noise else None


def propagated(transition: np.ndarray, covariance: np.ndarray, influence: np.ndarray,
               noise: np.ndarray) -> np.ndarray:
    """
    Return the covariance of values that are a linear function of others and of noise, NxN.

    :param transition: NxN, derivatives by the values before; their covariance, NxN.
    :param influence: NxK, derivatives by the noise; its covariance, KxK.
    """
    result = np.empty((len(covariance), len(covariance)))
    kernels.propagated_covariance(transition, covariance, influence, noise, result)
    return result
