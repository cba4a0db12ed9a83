# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whether covariances are right, by the normalised estimation error squared (NEES).

The NEES of an error e with covariance C is e^T C^-1 e. Where the errors are normal and C is right
it follows the chi-square distribution of as many degrees of freedom as e has numbers
(Bar-Shalom, Li and Kirubarajan 2001, 5.4): 6 on average here. More means too sure, less means
too careful.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.statistics import mean

DOF = 6

# The x at which the chi-square distribution of six degrees of freedom, in closed form
# 1 - exp(-x/2) (1 + x/2 + x^2/8), reaches 0.95 and 0.997.
QUANTILE_95 = 12.591587243743977
QUANTILE_997 = 19.8046523588496


@dataclass(frozen=True)
class Consistency:
    """
    How well covariances foretell errors; None of none.

    :param nees_mean: of the errors whose NEES is finite; it should be ``dof``.
    :param inside_95: share of the errors in the ellipsoid that should hold 95 %; inside_997 in
        that of 99.7 %. An infinite NEES is outside.
    """

    nees_mean: float | None
    dof: int
    inside_95: float | None
    inside_997: float | None

    @classmethod
    def of(cls, values: Iterable[float | None]) -> Consistency:
        """
        Return the figures of some NEES.

        :param values: as :func:`nees` returns them; None does not enter.
        """
        known = np.array([value for value in values if value is not None], np.float64)
        return cls(mean(known[np.isfinite(known)]), DOF,
                   mean(known <= QUANTILE_95), mean(known <= QUANTILE_997))


def nees(error: np.ndarray, covariance: np.ndarray) -> float | None:
    """
    Return the NEES of an error.

    :param error: 6; covariance: 6x6, of the same units.
    :returns: None where the covariance is not finite, as it promises nothing; infinite where it
        is not positive definite, as it promises more than can be.
    """
    if not np.all(np.isfinite(covariance)):
        return None
    variances = np.diag(covariance)
    if np.any(variances <= 0):
        return float('inf')
    sigmas = np.sqrt(variances)
    try:
        # of the correlations, lest metres and radians of very different size look singular
        factor = np.linalg.cholesky(covariance / np.outer(sigmas, sigmas))
    except np.linalg.LinAlgError:
        return float('inf')
    whitened = np.linalg.solve(factor, error / sigmas)
    return float(whitened @ whitened)


def density(values: np.ndarray) -> np.ndarray:
    """Return the density of the chi-square distribution of six degrees of freedom, from 0 up."""
    return values ** 2 * np.exp(-values / 2) / 16
