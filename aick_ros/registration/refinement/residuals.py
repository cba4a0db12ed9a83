# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What a pose leaves unexplained, whitened, with its derivatives: one function a kind of residual.

The derivatives are by the error of rigid.py: [R p] becomes [exp(theta) R, p + delta], columns
(delta, theta).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from aick_ros.frames.depth import inverse_depth_sigma
from aick_ros.frames.surface import Surface
from aick_ros.registration.refinement.tracks import Tracks
from aick_ros.settings import SensorSettings

_CORNER = 10.0  # times the noise of a depth on a surface
_SURFACE = 1.4
_BLOCK = 0.2  # side of a part of the image, on the plane z = 1
_BLOCKS_ACROSS = 100  # more than there are between the bounds of the rays
_ALIKE = 0.8  # cosine between the normals of a point and its plane
_NO_NOISE, _ALL_NOISE = 0.25, 0.75
"""Share of noise up to which a direction is kept, and from which it is left out."""

_WORST_SCALE = 4.0  # of residuals of a right pose by their noise
_MEDIAN_1, _MEDIAN_2 = 0.455, 1.386  # of chi squared with one and two degrees of freedom
_TINY = 1e-3 * np.eye(6)  # 30 m and 30 rad: makes any information invertible


@dataclass(frozen=True, eq=False)
class Residuals:
    """
    Residuals in units of their standard deviation.

    :param values: N.
    :param jacobian: Nx6.
    :param weights: N robust weights, 0 to 1.
    :param blocks: N, number of the part of the image that each is from.
    """

    values: np.ndarray
    jacobian: np.ndarray
    weights: np.ndarray
    blocks: np.ndarray

    def times(self, rate: float) -> Residuals:
        """Return the residuals for an error of which only a share acts."""
        return replace(self, jacobian=rate * self.jacobian)


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """
    A linear least-squares problem in the error of a pose.

    :param information: 6x6.
    :param gradient: 6, half the derivative of the weighted sum of squares.
    """

    information: np.ndarray
    gradient: np.ndarray

    @classmethod
    def of(cls, kinds: Iterable[Residuals]) -> NormalEquations:
        """Sum up residuals of several kinds."""
        information, gradient = np.zeros((6, 6)), np.zeros(6)
        for kind in kinds:
            weighted = kind.jacobian * kind.weights[:, None]
            information += weighted.T @ kind.jacobian
            gradient += weighted.T @ kind.values
        return cls(information, gradient)


def gradient_noise(kinds: Iterable[Residuals]) -> np.ndarray:
    """
    Return the covariance of the gradient as the residuals show it, 6x6.

    Residuals of one part of the image may be off together, so each part counts as one sample
    (Liang and Zeger 1986), with the usual correction for few of them.
    """
    noise = np.zeros((6, 6))
    for kind in kinds:
        gradients = kind.jacobian * (kind.weights * kind.values)[:, None]
        sums = np.stack([np.bincount(kind.blocks, column) for column in gradients.T])
        parts = np.count_nonzero(np.bincount(kind.blocks))
        noise += sums @ sums.T * (parts / max(parts - 6, 1)) * (parts / max(parts - 7, 1))
    return noise


def _blocks(rays: np.ndarray) -> np.ndarray:
    """Return the number of the part of the image in which each ray is, N."""
    u, v = ((np.clip(rays, -2.0, 2.0) + 2.0) / _BLOCK).astype(np.intp).T
    return u * _BLOCKS_ACROSS + v


def geman_mcclure(squares: np.ndarray, width: float) -> np.ndarray:
    """
    Return the weights of residuals by their squares (Geman and McClure 1985).

    :param width: residual, in standard deviations, whose weight is a quarter.
    """
    return 1.0 / (1.0 + squares / width ** 2) ** 2


def robust_weights(squares: np.ndarray, width: float, median: float = _MEDIAN_1) -> np.ndarray:
    """
    Return the weights of residuals among which at most half do not belong.

    Calibration and shutter, which the noise does not know, make all residuals of some pairs
    larger: the weights widen with them, so that no consistent few outvote the rest.

    :param squares: of the whitened residuals.
    :param width: in standard deviations, as the noise or the residuals have it, the larger one.
    :param median: of the squares where the noise explains them.
    """
    if len(squares) == 0:
        return squares
    scale = np.clip(np.median(squares) / median, 1.0, _WORST_SCALE ** 2)
    return geman_mcclure(squares, width * np.sqrt(scale))


def reprojection(tracks: Tracks, T_target_source: np.ndarray, ray_sigma: float,
                 width: float) -> Residuals:
    """
    Where the target sees the points of the source, against where the pose puts them.

    Their noise is that of the image and, along the epipolar line, that of the source's depth.

    :param ray_sigma: of a track on the plane z = 1.
    :returns: two residuals a track, all of the first coordinate, then all of the second.
    """
    a, b, c = arms = (tracks.points @ T_target_source[:3, :3].T).T
    x, y, z = arms + T_target_source[:3, 3:]
    x, y, zero = x / z, y / z, np.zeros(len(z))
    off = np.stack([x, y]) - tracks.rays.T
    # the derivatives of x and of y, by the six errors
    by_error = np.array([[1 / z, zero, -x / z, -b * x / z, (c + a * x) / z, -b / z],
                         [zero, 1 / z, -y / z, -(c + b * y) / z, a * y / z, a / z]])
    # whiten by the inverse root of S = ray_sigma^2 I + s s^T, s by the noise of the depth
    s = np.stack([a - c * x, b - c * y]) * (tracks.sigmas * tracks.points[:, 2] / z)
    length = (s * s).sum(axis=0)
    shrink = (1.0 - ray_sigma / np.sqrt(ray_sigma ** 2 + length)) / np.maximum(length, 1e-30)
    values = (off - s * (shrink * (s * off).sum(axis=0))) / ray_sigma
    shrunk = shrink * (s[:, None] * by_error).sum(axis=0)
    by_error = (by_error - s[:, None] * shrunk) / ray_sigma
    weights = robust_weights((values * values).sum(axis=0), width, _MEDIAN_2)
    return Residuals(values.ravel(), by_error.transpose(0, 2, 1).reshape(-1, 6),
                     np.tile(weights, 2), np.tile(_blocks(tracks.rays), 2))


def track_depth(tracks: Tracks, T_target_source: np.ndarray, sensor: SensorSettings,
                width: float) -> Residuals:
    """
    The depth the target measures at the tracks, against that of the moved points.

    Corners lie on edges, where a depth is off by far more than its noise.
    """
    measured = np.flatnonzero(np.isfinite(tracks.depths))
    arms = tracks.points[measured] @ T_target_source[:3, :3].T
    z = arms[:, 2] + T_target_source[2, 3]
    sigma = _CORNER * inverse_depth_sigma(z, sensor)
    values = (1 / tracks.depths[measured] - 1 / z) / sigma
    jacobian = np.zeros((len(measured), 6))
    jacobian[:, 2] = 1.0
    jacobian[:, 3], jacobian[:, 4] = arms[:, 1], -arms[:, 0]
    jacobian /= (sigma * z ** 2)[:, None]
    return Residuals(values, jacobian, robust_weights(values ** 2, width),
                     _blocks(tracks.rays[measured]))


def point_to_plane(source: Surface, target: Surface, T_target_source: np.ndarray,
                   sensor: SensorSettings, width: float, reach: float) -> Residuals:
    """
    The distances of the source's chosen points from the planes the target sees there.

    The partner of a point is the cell it falls on (Blais and Levine 1995). What a cell averages
    has much of its noise in common with its neighbours: the noise is taken as that of one pixel.

    :param reach: partners farther apart are left out [m].
    """
    # take() gathers rows several times as fast as indexing does
    rotation = T_target_source[:3, :3]
    arms = source.points.take(source.chosen, 0) @ rotation.T
    moved = arms + T_target_source[:3, 3]
    seen, cells = target.cells_at(moved)
    normals = target.normals.take(cells, 0).astype(np.float64)
    turned = source.normals.take(source.chosen.take(seen), 0) @ rotation.T
    distances = np.einsum('ij,ij->i', moved.take(seen, 0) - target.points.take(cells, 0), normals)
    fits = np.flatnonzero((np.abs(distances) < reach)
                          & (np.einsum('ij,ij->i', turned, normals) > _ALIKE))
    arms, moved = (rows.take(seen.take(fits), 0) for rows in (arms, moved))
    normals, turned, distances = (rows.take(fits, 0) for rows in (normals, turned, distances))
    # a change of the inverse depth by sigma moves the point along its ray by sigma z^2
    z = moved[:, 2]
    sigmas = _SURFACE * inverse_depth_sigma(z, sensor) * z * np.einsum(
        'ij,ij->i', moved, normals)
    values = distances / sigmas
    jacobian, other = (_of_planes(n, arms, sigmas) for n in (normals, turned))
    return Residuals(values, jacobian @ _common(jacobian, other),
                     robust_weights(values ** 2, width), _blocks(moved[:, :2] / z[:, None]))


def _of_planes(normals: np.ndarray, arms: np.ndarray, sigmas: np.ndarray) -> np.ndarray:
    """Return the derivatives (n, arm x n) of the distances from planes, whitened, Nx6."""
    jacobian = np.empty((6, len(normals)))
    (x, y, z), (a, b, c) = arms.T, (normals / sigmas[:, None]).T
    jacobian[0], jacobian[1], jacobian[2] = a, b, c
    jacobian[3], jacobian[4], jacobian[5] = y * c - z * b, z * a - x * c, x * b - y * a
    return jacobian.T


def _common(jacobian: np.ndarray, other: np.ndarray) -> np.ndarray:
    """
    Return the projection of errors on the directions of which a Jacobian tells beyond its noise.

    The noise of normals makes a wall seem rough, as if it could not be moved along itself. Two
    measurements of the Jacobian have their noise for themselves, so half the square of their
    difference is the noise in the square of one.

    :returns: 6x6; the identity where all directions are told.
    """
    difference = jacobian - other
    root = np.linalg.cholesky(jacobian.T @ jacobian + _TINY)
    noise = np.linalg.solve(root, difference.T @ difference / 2)
    shares, directions = np.linalg.eigh(np.linalg.solve(root, noise.T))
    kept = np.sqrt(np.clip((_ALL_NOISE - shares) / (_ALL_NOISE - _NO_NOISE), 0.0, 1.0))
    return np.linalg.solve(root.T, directions * kept) @ directions.T @ root.T
