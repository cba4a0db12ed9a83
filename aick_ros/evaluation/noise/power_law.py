# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fit of a power law y = scale * x ^ exponent: a robust line through the logarithms."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry.median import SIGMA_PER_MEDIAN

_ITERATIONS = 30  # chosen
_HUBER = 1.345  # derived: 95 % efficiency on normal errors (Huber 1964)
_MIN_RESIDUAL = 1e-6  # smaller residuals of the logarithms count as zero; chosen


def fit_exponent(x: np.ndarray, y: np.ndarray, weights: np.ndarray) -> float:
    """
    Return the exponent of the best fit.

    :param x: N, positive, at least two of them different.
    :param y: N, positive.
    :param weights: of the points, N.
    """
    design = np.stack([np.ones(len(x)), np.log(x)], axis=1)
    return float(_fit(design, np.log(y), weights)[1])


def fit_scale(x: np.ndarray, y: np.ndarray, weights: np.ndarray, exponent: float) -> float:
    """Return the scale of the best fit with a given exponent; see :func:`fit_exponent`."""
    return float(np.exp(_fit(np.ones((len(x), 1)), np.log(y) - exponent * np.log(x), weights)[0]))


def _fit(design: np.ndarray, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the coefficients of a linear fit by iteratively reweighted least squares."""
    robust = np.ones(len(values))
    coefficients: np.ndarray
    for _ in range(_ITERATIONS):
        root = np.sqrt(weights * robust)
        coefficients = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
        residuals = np.abs(values - design @ coefficients)
        width = _HUBER * max(SIGMA_PER_MEDIAN * float(np.median(residuals)), _MIN_RESIDUAL)
        robust = np.minimum(1.0, width / np.maximum(residuals, _MIN_RESIDUAL))
    return coefficients
