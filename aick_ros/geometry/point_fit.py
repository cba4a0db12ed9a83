# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Least-squares rigid transform between matched points."""

from __future__ import annotations

import numpy as np

from aick_ros import kernels

_COLLINEAR = 1e-6  # chosen: smaller ratio of the second to the first singular value is a line
_ROUNDING = 1e-13  # chosen: relative rounding error of the sums of products, some hundred eps


class DegenerateGeometryError(ValueError):
    """Points that do not determine a rigid transform: fewer than three, or collinear."""


def fit(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """
    Return the rigid transform that minimises the squared distances of matched points.

    Closed form by singular value decomposition (Arun et al. 1987), without reflections (Umeyama
    1991), so that coplanar points are allowed.

    :param source: Nx3 [m].
    :param target: Nx3 [m], matched row by row.
    :returns: ``T_target_source``, 4x4.
    :raises DegenerateGeometryError: if the points do not determine the rotation.
    """
    source = np.asarray(source, np.float64)
    target = np.asarray(target, np.float64)
    if len(source) < 3:
        raise DegenerateGeometryError(f'{len(source)} matched points: at least 3 are required')
    source_mean = np.add.reduce(source) / len(source)
    target_mean = np.add.reduce(target) / len(target)
    centred = np.zeros((4, 4))
    centred[:3, :3] = (source - source_mean).T @ (target - target_mean)
    centred[3, 3] = len(source)
    pose = _fit(centred, 0.0)
    pose[:3, 3] = target_mean - pose[:3, :3] @ source_mean
    return pose


def moments(source: np.ndarray, target: np.ndarray, matches: np.ndarray) -> np.ndarray:
    """
    Return the moments of matched points: ``a.T @ b`` of their homogeneous coordinates, 4x4.

    :param source: Nx3 float32 [m].
    :param target: Mx3 float32 [m].
    :param matches: Kx2 int64, rows (source, target).
    """
    sums = np.zeros((4, 4))
    kernels.moments(source, target, matches, sums)
    return sums


def fit_moments(moments: np.ndarray) -> np.ndarray:
    """
    Return the same as :func:`fit` from the moments of the points, in a fraction of the time.

    The rounding error of uncentred moments is negligible as long as the points are not much
    farther from the origin than from each other.

    :param moments: 4x4 float64, of :func:`moments`.
    :returns: ``T_target_source``, 4x4.
    :raises DegenerateGeometryError: if the points do not determine the rotation.
    """
    if moments[3, 3] < 3:
        raise DegenerateGeometryError(
            f'{moments[3, 3]:.0f} matched points: at least 3 are required')
    return _fit(moments, _ROUNDING)


def _fit(moments: np.ndarray, rounding: float) -> np.ndarray:
    """
    Return the transform by moments of at least three points.

    :param rounding: relative rounding error of the moments.
    """
    pose = np.empty((4, 4))
    if not kernels.fit_moments(moments, _COLLINEAR, rounding, pose):
        raise DegenerateGeometryError(
            f'{moments[3, 3]:.0f} matched points are collinear or coincide')
    return pose


def homogeneous(points: np.ndarray) -> np.ndarray:
    """Return points in homogeneous coordinates, Nx4, of the same type."""
    extended = np.empty((len(points), 4), points.dtype)
    extended[:, :3] = points
    extended[:, 3] = 1.0
    return extended
