# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Kalman update: what a linear measurement changes in an estimate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import definite

LARGEST_SQUARED_DISTANCE = 16.3
"""Of three values measured. Derived: noise exceeds it in one of a thousand updates, by the
chi-squared distribution."""


@dataclass(frozen=True, eq=False)
class KalmanUpdate:
    """
    Update of an estimate of N values by K linear measurements of them.

    :param prior: NxN, covariance of the estimate before.
    :param rows: KxN, derivatives of what is measured by the values.
    :param noise: KxK, covariance of the measurements.
    :param expected: KxK, covariance of the measurement less the estimate.
    :param gain: NxK; times that difference it is the change of the estimate.
    """

    prior: np.ndarray
    rows: np.ndarray
    noise: np.ndarray
    expected: np.ndarray
    gain: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, rows: np.ndarray, noise: np.ndarray) -> KalmanUpdate:
        """Return the update of an estimate with a covariance; parameters as of the class."""
        seen = rows @ covariance
        expected = seen @ rows.T + noise
        return cls(covariance, rows, noise, expected, definite.solve(expected, seen).T)

    @property
    def kept(self) -> np.ndarray:
        """Share of the errors of the estimate that is left, NxN."""
        kept: np.ndarray = np.eye(len(self.prior)) - self.gain @ self.rows
        return kept

    @property
    def covariance(self) -> np.ndarray:
        """Covariance of the estimate afterwards, NxN."""
        # in the form of Joseph, which stays positive definite
        kept = self.kept
        left = kept @ self.prior @ kept.T + self.gain @ self.noise @ self.gain.T
        symmetric: np.ndarray = 0.5 * (left + left.T)
        return symmetric

    def squared_distance(self, error: np.ndarray) -> float:
        """Return the square of a difference, K, by its covariance; noise gives K in the mean."""
        return float(error @ definite.solve(self.expected, error))
