# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Linear equations with a symmetric positive definite matrix, by its Cholesky factor.

Of six unknowns, NumPy's general solution takes several times as long.
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros import kernels

_NO_SIDES = np.empty(0)


def solved(matrix: np.ndarray, sides: np.ndarray) -> np.ndarray | None:
    """
    Return the solutions of linear equations; None where the matrix is not positive definite.

    :param matrix: NxN, of which the lower triangle is used.
    :param sides: N or NxK, the right sides.
    :returns: of the shape of the right sides.
    """
    solution = np.array(sides, np.float64, order='C')
    count = 1 if solution.ndim == 1 else solution.shape[1]
    is_definite = kernels.solve_definite(matrix, solution, count)
    return solution if is_definite else None


def solve(matrix: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """
    Return the solutions of linear equations, as ``np.linalg.solve`` does.

    :param matrix: NxN, symmetric, positive definite but for rounding.
    :param sides: N or NxK, the right sides.
    """
    solution = solved(matrix, sides)
    return np.linalg.solve(matrix, sides) if solution is None else solution


def eliminated(information: np.ndarray, gradients: np.ndarray,
               prior: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """
    Return normal equations without their first unknowns, by the Schur complement.

    :param information: NxN.
    :param gradients: KxN, right sides of several equations with this information.
    :param prior: MxM, added to the information about the M unknowns that are eliminated.
    :returns: the information about the others, and the gradients; None where that about the first
        ones is not positive definite.
    """
    rest = len(information) - len(prior)
    left, left_gradients = np.empty((rest, rest)), np.empty((len(gradients), rest))
    is_done = kernels.eliminate(information, gradients, prior, left, left_gradients)
    return (left, left_gradients) if is_done else None


def is_definite(matrix: np.ndarray) -> bool:
    """Return whether a matrix, NxN, is positive definite."""
    return kernels.solve_definite(matrix, _NO_SIDES, 0)


def nonnegative(covariance: np.ndarray) -> np.ndarray:
    """Return a covariance, NxN, without variances that rounding has left just below zero."""
    if is_definite(covariance):
        return covariance
    variances, axes = np.linalg.eigh(covariance)
    rounded: np.ndarray = axes * np.maximum(variances, 0.0) @ axes.T
    return rounded


def largest_sigma(covariance: np.ndarray) -> float:
    """Return the standard deviation along the direction in which it is largest, of NxN."""
    return math.sqrt(np.linalg.eigvalsh(covariance)[-1])


def inverse(matrix: np.ndarray) -> np.ndarray:
    """
    Return the inverse of a matrix, NxN.

    :param matrix: NxN, symmetric, positive definite but for rounding.
    """
    return solve(matrix, np.eye(len(matrix)))
