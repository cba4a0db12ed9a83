# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A pose by one sensor alone, keypoints or depth, and what that adds to the pose by both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.registration.refinement.mean_scatter import SHARE
from aick_ros.registration.refinement.residuals import PRIOR, NormalEquations, Residuals, curvature

_SMALLEST_FACTOR = 0.01
"""Least variance, as a ratio to that by the sensor's noise: a tenth of its sigma, chosen.

Residuals that vanish, as those of an image that is repeated, are no measurement without an error.
"""

_NONE = Residuals(np.empty(0), np.empty((0, 6)), np.empty(0), np.empty(0, np.int64))


@dataclass(frozen=True, eq=False)
class Estimate:
    """
    The error of a pose by the residuals of one sensor, to first order, and their equations.

    :param error: 6; the estimate has the prior for itself.
    :param covariance: of the error by the scatter of the residuals about it, 6x6.
    :param expected_covariance: likewise, by the scatter expected of them.
    :param design_effect: variance by their scatter, as a ratio to that by the noise assumed; 1
        without data.
    :param shown: their scatter, 6x6, in units of the information.
    :param marginal: weighted normal equations without the prior, the bias marginalised.
    :param scatter: covariance of their gradient by the scatter expected, 6x6.
    :param curvature: of the robust cost, as a ratio to what the information says.
    """

    error: np.ndarray
    covariance: np.ndarray
    expected_covariance: np.ndarray
    design_effect: float
    shown: np.ndarray
    marginal: NormalEquations
    scatter: np.ndarray
    curvature: float

    @classmethod
    def of(cls, kinds: Sequence[Residuals], weight: float, bias: np.ndarray,
           shape: np.ndarray | None = None) -> Estimate:
        """
        Return the estimate by residuals of up to two kinds.

        :param weight: of them in the joint estimate.
        :param bias: covariance of the one that they see the pose with, 6x6, diagonal.
        :param shape: of their scatter as it is in the mean, 6x6, in units of the information, with
            a trace of 6; None: not known.
        """
        one, other = (*kinds, _NONE, _NONE)[:2]
        error, (covariance, expected, shown) = np.empty(6), np.empty((3, 6, 6))
        information, gradient, scatter = np.empty((6, 6)), np.empty(6), np.empty((6, 6))
        design_effect = kernels.estimate(
            one.jacobian, one.values, one.weights, one.blocks, other.jacobian, other.values,
            other.weights, other.blocks, PRIOR, weight, bias, PRIOR if shape is None else shape,
            0.0 if shape is None else SHARE, error, covariance, expected, shown, information,
            gradient, scatter)
        return cls(error, covariance, expected, design_effect, shown,
                   NormalEquations(information, gradient), scatter, curvature(kinds))


def joint_estimate(keypoints: Estimate, depth: Estimate, pose: np.ndarray,
                   bias: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Return the pose by both sensors, its covariance, and by how much it follows depth.

    The covariance is A^-1 B A^-1 and that of the bias. A is the curvature of the robust cost, B
    the covariance of the gradient by the scatter that each sensor has about its own optimum, in
    the mean over the unknowns no less than a small share of the information; the
    prior is part of both, once.

    :param pose: 4x4, about which both are estimated.
    :param bias: covariance of the one between them, 6x6.
    :returns: 4x4, 6x6 and 6x6.
    """
    found, covariance, gain = np.empty((4, 4)), np.empty((6, 6)), np.empty((6, 6))
    kernels.joint_estimate(
        keypoints.marginal.information, keypoints.marginal.gradient, keypoints.scatter,
        keypoints.curvature, depth.marginal.information, depth.marginal.gradient, depth.scatter,
        depth.curvature, PRIOR, _SMALLEST_FACTOR, bias, pose, found, covariance, gain)
    return found, covariance, gain
