# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Consistency of covariances by the normalised estimation error squared (NEES).

The NEES of an error e with covariance C is e^T C^-1 e. If the errors are normal and C is correct,
it follows the chi-square distribution with as many degrees of freedom as e has elements
(Bar-Shalom, Li and Kirubarajan 2001, 5.4), so its mean is 6 for a pose, and 3 for its translation
or rotation alone. A larger mean indicates an overconfident covariance, a smaller one a
conservative covariance.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.statistics import mean

DOF = 6  # by definition: degrees of freedom of a pose

# derived: the chi-square distribution function with six degrees of freedom is
# 1 - exp(-x/2) (1 + x/2 + x^2/8)
QUANTILE_95 = 12.591587243743977
QUANTILE_997 = 19.8046523588496

QUANTILES = {DOF: (QUANTILE_95, QUANTILE_997),
             3: (7.814727903251179, 13.931422665512084)}
"""Degrees of freedom -> 95 and 99.7 % quantiles of the chi-square distribution; derived."""


@dataclass(frozen=True)
class Consistency:
    """
    Statistics of the NEES; None without values.

    :param nees_mean: mean of the finite values; ``dof`` for a correct covariance.
    :param dof: degrees of freedom.
    :param inside_95: share of the errors inside the 95 % ellipsoid; an infinite NEES is outside.
    :param inside_997: share of the errors inside the 99.7 % ellipsoid.
    """

    nees_mean: float | None
    dof: int
    inside_95: float | None
    inside_997: float | None

    @classmethod
    def of(cls, values: Iterable[float | None], dof: int = DOF) -> Consistency:
        """
        Return the statistics of some NEES.

        :param values: as :func:`nees` returns them; None is ignored.
        :param dof: 6, or 3 for translations or rotations alone.
        """
        inside_95, inside_997 = QUANTILES[dof]
        known = np.array([value for value in values if value is not None], np.float64)
        return cls(mean(known[np.isfinite(known)]), dof,
                   mean(known <= inside_95), mean(known <= inside_997))


def nees(error: np.ndarray, covariance: np.ndarray) -> float | None:
    """
    Return the NEES of an error.

    :param error: 6, or 3 of them.
    :param covariance: 6x6 or 3x3, in the same units.
    :returns: None where the covariance is not finite, as it claims nothing; infinite where it is
        not positive definite, as it claims the impossible.
    """
    if not np.all(np.isfinite(covariance)):
        return None
    variances = np.diag(covariance)
    if np.any(variances <= 0):
        return float('inf')
    sigmas = np.sqrt(variances)
    try:
        # of the correlation matrix: metres and radians may differ by orders of magnitude
        factor = np.linalg.cholesky(covariance / np.outer(sigmas, sigmas))
    except np.linalg.LinAlgError:
        return float('inf')
    whitened = np.linalg.solve(factor, error / sigmas)
    return float(whitened @ whitened)


def density(values: np.ndarray) -> np.ndarray:
    """Return the chi-square density with six degrees of freedom at values >= 0, N."""
    densities: np.ndarray = values ** 2 * np.exp(-values / 2) / 16
    return densities
