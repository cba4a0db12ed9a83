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
        seen = rows @ covariance
        expected = seen @ rows.T + noise
        gain = definite.solve(expected, seen).T
        kept = np.eye(len(covariance)) - gain @ rows
        # in the form of Joseph, which stays positive definite
        left = kept @ covariance @ kept.T + gain @ noise @ gain.T
        return cls(expected, gain, kept, 0.5 * (left + left.T))

    def squared_distance(self, error: np.ndarray) -> float:
        """Return the square of a difference, K, by its covariance; noise gives K in the mean."""
        return float(error @ definite.solve(self.expected, error))
