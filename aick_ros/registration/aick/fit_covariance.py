# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Covariance of a rigid fit to matched keypoints, from the noise of their positions."""

from __future__ import annotations

import numpy as np

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import se3

_CELL = 4  # px; chosen: keypoints this close, found at several scales, share their noise
_SMALLEST_NOISE = 1e-12 * np.eye(3)  # m^2; chosen: far below any sensor, keeps the sum invertible


def fit_covariance(T_target_source: np.ndarray, source: KeypointFrame, target: KeypointFrame,
                   matches: np.ndarray) -> np.ndarray:
    """
    Return the covariance of an unweighted least-squares fit to matches.

    Residuals larger than the noise of the keypoints explains scale that noise up. Smaller ones do
    not scale it down: matches were selected for their small residuals.

    :param matches: Kx2, rows (source keypoint, target keypoint), enough for a fit.
    :returns: 6x6 (x, y, z, rot x, rot y, rot z) about the target's fixed axes
        [m^2, m rad, rad^2].
    """
    rotation = T_target_source[:3, :3]
    sources, targets = matches.T
    arms = source.positions[sources].astype(np.float64) @ rotation.T
    residuals = arms + T_target_source[:3, 3] - target.positions[targets]
    # R C R^T of all points in one product, as (R kron R) vec(C): ten times as fast
    rotated = source.covariances[sources].reshape(-1, 9) @ np.kron(rotation, rotation).T
    noise = rotated.reshape(-1, 3, 3) + target.covariances[targets] + _SMALLEST_NOISE
    chi_square = np.einsum('ni,ni->', residuals,
                           np.linalg.solve(noise, residuals[:, :, None])[:, :, 0])
    scale = max(1.0, chi_square / max(3 * len(matches) - 6, 1))
    noise *= (scale * _cell_counts(target.pixels[targets]))[:, None, None]
    jacobian = se3.point_jacobian(arms)
    noise_jacobian = (noise @ jacobian).reshape(-1, 6)
    jacobian = jacobian.reshape(-1, 6)
    inverse = np.linalg.inv(jacobian.T @ jacobian)  # of full rank, as the fit exists
    covariance: np.ndarray = inverse @ (jacobian.T @ noise_jacobian) @ inverse
    return covariance


def _cell_counts(pixels: np.ndarray) -> np.ndarray:
    """Return how many of the pixels lie in the cell of each, itself included, N."""
    column, row = (np.maximum(pixels, 0) // _CELL).astype(np.intp).T
    cells = row * (column.max() + 1) + column
    counts: np.ndarray = np.bincount(cells)[cells]
    return counts
