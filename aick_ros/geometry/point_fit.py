# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Least-squares fit of a rigid transform to matched points."""

from __future__ import annotations

import cv2
import numpy as np

_COLLINEAR = 1e-6  # second to first singular value: below it a turn is not determined
_ROUNDING = 1e-13  # of sums of products, as a share of them


class DegenerateGeometryError(ValueError):
    """Points that do not determine a rigid transform: fewer than three, or on one line."""


def fit(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """
    Return the rigid transform with the least squared distance between matched points.

    Closed form by singular values (Arun et al. 1987), with the reflection ruled out (Umeyama
    1991), so coplanar points are no problem.

    :param source: Nx3 [m].
    :param target: Nx3 [m], matched row by row.
    :returns: ``T_target_source``, 4x4.
    :raises DegenerateGeometryError: where the points leave a rotation undetermined.
    """
    source = np.asarray(source, np.float64)
    target = np.asarray(target, np.float64)
    if len(source) < 3:
        raise DegenerateGeometryError(f'{len(source)} matched points: a fit takes three')
    source_mean = np.add.reduce(source) / len(source)
    target_mean = np.add.reduce(target) / len(target)
    return _fit((source - source_mean).T @ (target - target_mean), source_mean, target_mean,
                len(source))


def fit_moments(moments: np.ndarray) -> np.ndarray:
    """
    Return what :func:`fit` does, of the sums that it takes, in a fraction of the time.

    What the sums lose to rounding is nothing for points that are far apart, as things measure
    that are within reach of each other.

    :param moments: 4x4 float64, the transpose of the source times the target, both Kx4 of
        :func:`homogeneous`.
    """
    count = float(moments[3, 3])
    if count < 3:
        raise DegenerateGeometryError(f'{count:.0f} matched points: a fit takes three')
    source_mean, target_mean = moments[:3, 3] / count, moments[3, :3] / count
    cross = moments[:3, :3] - moments[:3, 3:] * target_mean
    return _fit(cross, source_mean, target_mean, count, _ROUNDING * cv2.norm(moments))


def _fit(cross: np.ndarray, source_mean: np.ndarray, target_mean: np.ndarray, count: float,
         rounding: float = 0.0) -> np.ndarray:
    """Return the transform of the sums of products of centred points, 3x3, and the centres."""
    # of a matrix as small as this OpenCV's takes a quarter of the time of NumPy's
    singular, u, vt = cv2.SVDecomp(cross)
    if singular[1, 0] <= _COLLINEAR * singular[0, 0] + rounding:
        raise DegenerateGeometryError(f'{count:.0f} matched points lie on a line or in a point')
    rotation = (u @ vt).T
    if _reflects(rotation):
        u[:, 2] = -u[:, 2]
        rotation = (u @ vt).T
    pose = np.zeros((4, 4))  # np.eye takes longer
    pose[:3, :3] = rotation
    pose[:3, 3] = target_mean - rotation @ source_mean
    pose[3, 3] = 1.0
    return pose


def homogeneous(points: np.ndarray) -> np.ndarray:
    """Return points with a 1 behind each, Nx4, of their own type."""
    extended = np.empty((len(points), 4), points.dtype)
    extended[:, :3] = points
    extended[:, 3] = 1.0
    return extended


def _reflects(matrix: np.ndarray) -> bool:
    """Return whether the determinant of a 3x3 matrix is negative; np.linalg.det takes longer."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0
