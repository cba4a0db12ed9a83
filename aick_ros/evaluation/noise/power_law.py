# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fits of y = scale * x ^ exponent: straight lines between the logarithms, robust to outliers."""

from __future__ import annotations

import numpy as np

_ITERATIONS = 30
_HUBER = 1.345  # standard deviations up to which a point has its full weight (Huber 1964)
_TO_SIGMA = 1.4826  # of the median absolute deviation of a normal distribution
_EXACT = 1e-6  # relative; points nearer than this are on the line


def fit_exponent(x: np.ndarray, y: np.ndarray, weights: np.ndarray) -> float:
    """
    Fit the exponent, whatever the scale.

    :param x: N > 0, two of them different.
    :param y: N > 0.
    :param weights: N, how much each point counts.
    """
    design = np.stack([np.ones(len(x)), np.log(x)], axis=1)
    return float(_fit(design, np.log(y), weights)[1])


def fit_scale(x: np.ndarray, y: np.ndarray, weights: np.ndarray, exponent: float) -> float:
    """Fit the scale that goes with an exponent; see :func:`fit_exponent`."""
    return float(np.exp(_fit(np.ones((len(x), 1)), np.log(y) - exponent * np.log(x), weights)[0]))


def _fit(design: np.ndarray, values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the coefficients of a linear fit, by iteratively reweighted least squares."""
    robust = np.ones(len(values))
    for _ in range(_ITERATIONS):
        root = np.sqrt(weights * robust)
        coefficients = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
        off = np.abs(values - design @ coefficients)
        width = _HUBER * max(_TO_SIGMA * float(np.median(off)), _EXACT)
        robust = np.minimum(1.0, width / np.maximum(off, _EXACT))
    return coefficients
