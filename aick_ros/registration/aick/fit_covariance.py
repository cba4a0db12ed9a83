# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How sure a rigid fit to matched keypoints is, by the noise of their positions."""

from __future__ import annotations

import numpy as np

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.geometry import se3

_CELL = 4  # px; keypoints of one place, found at several scales, have their noise in common
_FINEST = 1e-12 * np.eye(3)  # m^2; no position is better known


def fit_covariance(T_target_source: np.ndarray, source: KeypointFrame, target: KeypointFrame,
                   matches: np.ndarray) -> np.ndarray:
    """
    Return the covariance of a least-squares fit in which all matches count the same.

    Where the residuals are larger than the noise of the keypoints makes them, the noise is taken
    to be larger. They are not taken for it where they are smaller: a match is only one where its
    residual is small.

    :param matches: Kx2, rows (source keypoint, target keypoint), enough for a fit.
    :returns: 6x6 (x, y, z, rot x, rot y, rot z) about the target's fixed axes
        [m^2, m rad, rad^2].
    """
    rotation = T_target_source[:3, :3]
    sources, targets = matches.T
    arms = source.positions[sources].astype(np.float64) @ rotation.T
    residuals = arms + T_target_source[:3, 3] - target.positions[targets]
    # R C R^T of all at once: of matrices so small a product each takes ten times as long
    turned = source.covariances[sources].reshape(-1, 9) @ np.kron(rotation, rotation).T
    noise = turned.reshape(-1, 3, 3) + target.covariances[targets] + _FINEST
    jacobian = se3.point_jacobian(arms)
    square = np.einsum('ni,ni->', residuals,
                       np.linalg.solve(noise, residuals[:, :, None])[:, :, 0])
    larger = max(1.0, square / max(3 * len(matches) - 6, 1))
    noise *= (larger * _in_common(target.pixels[targets]))[:, None, None]
    spread = (noise @ jacobian).reshape(-1, 6)
    jacobian = jacobian.reshape(-1, 6)
    inverse = np.linalg.inv(jacobian.T @ jacobian)  # a fit there is, so it has full rank
    return inverse @ (jacobian.T @ spread) @ inverse


def _in_common(pixels: np.ndarray) -> np.ndarray:
    """Return how many of some pixels lie in the same cell as each, N."""
    column, row = (np.maximum(pixels, 0) // _CELL).astype(np.intp).T
    cells = row * (column.max() + 1) + column
    return np.bincount(cells)[cells]
