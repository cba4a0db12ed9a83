# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Least-squares rigid transform between matched points."""

from __future__ import annotations

import cv2
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
    return _fit((source - source_mean).T @ (target - target_mean), source_mean, target_mean,
                len(source))


def moments(source: np.ndarray, target: np.ndarray, matches: np.ndarray) -> np.ndarray:
    """
    Return the moments of matched points: ``a.T @ b`` of their homogeneous coordinates, 4x4.

    :param source: Nx3 float32 [m].
    :param target: Mx3 float32 [m].
    :param matches: Kx2 int64, rows (source, target).
    """
    sums = np.zeros((4, 4))
    kernels.moments(np.ascontiguousarray(source), np.ascontiguousarray(target), matches, sums)
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
    count = float(moments[3, 3])
    if count < 3:
        raise DegenerateGeometryError(f'{count:.0f} matched points: at least 3 are required')
    source_mean, target_mean = moments[:3, 3] / count, moments[3, :3] / count
    cross = moments[:3, :3] - moments[:3, 3:] * target_mean
    return _fit(cross, source_mean, target_mean, count, _ROUNDING * cv2.norm(moments))


def _fit(cross: np.ndarray, source_mean: np.ndarray, target_mean: np.ndarray, count: float,
         rounding: float = 0.0) -> np.ndarray:
    """
    Return the transform from the cross-covariance of the points and their centroids.

    :param cross: 3x3, sum of the products of centred source and target points.
    :param rounding: absolute rounding error of ``cross``.
    """
    # for a matrix this small OpenCV takes a quarter of the time of NumPy
    singular, u, vt = cv2.SVDecomp(cross)
    if singular[1, 0] <= _COLLINEAR * singular[0, 0] + rounding:
        raise DegenerateGeometryError(f'{count:.0f} matched points are collinear or coincide')
    rotation = (u @ vt).T
    if _reflects(rotation):
        u[:, 2] = -u[:, 2]
        rotation = (u @ vt).T
    pose = np.zeros((4, 4))  # faster than np.eye
    pose[:3, :3] = rotation
    pose[:3, 3] = target_mean - rotation @ source_mean
    pose[3, 3] = 1.0
    return pose


def homogeneous(points: np.ndarray) -> np.ndarray:
    """Return points in homogeneous coordinates, Nx4, of the same type."""
    extended = np.empty((len(points), 4), points.dtype)
    extended[:, :3] = points
    extended[:, 3] = 1.0
    return extended


def _reflects(matrix: np.ndarray) -> bool:
    """Return whether the determinant of a 3x3 matrix is negative, faster than np.linalg.det."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    determinant: float = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return determinant < 0
