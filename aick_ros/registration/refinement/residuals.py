# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whitened residuals of a pose with their Jacobians: one function per kind of residual.

The Jacobians are with respect to the pose error of :mod:`aick_ros.geometry.se3`: [R p] becomes
[exp(theta) R, p + delta], columns (delta, theta).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from statistics import NormalDist

import numpy as np

from aick_ros.frames.depth import inverse_depth_sigma
from aick_ros.frames.surface import Surface
from aick_ros.geometry.median import median
from aick_ros.registration.refinement.tracks import Tracks
from aick_ros.settings import SensorSettings

SURFACE_NOISE = 1.4
"""Noise of a depth on a smooth surface, as a ratio to the sensor model. Chosen."""

_CORNER_NOISE = 10.0  # chosen: the same ratio at a corner, where depths have edges
_BLOCK = 0.2  # chosen: side of a block of the image with common errors, on the plane z = 1
_RAY_LIMIT = 2.0  # chosen: rays farther out than this on the plane z = 1 share the outer blocks
_BLOCKS_ACROSS = 100  # more than 2 * _RAY_LIMIT / _BLOCK
_SMALLEST_COSINE = 0.8  # chosen: between the normals of a point and of its plane
_SHARE_OBSERVED, _SHARE_UNOBSERVED = 0.25, 0.75
"""Share of noise in the information about a direction, chosen.

Up to the first the direction counts as observed, from the second as not, linearly in between.
"""

_LARGEST_SCALE = 4.0  # chosen: of the residuals of a right pose, in units of their noise
# medians of chi-square with 1 and 2 degrees of freedom; derived
_MEDIAN_1 = NormalDist().inv_cdf(0.75) ** 2
_MEDIAN_2 = 2.0 * math.log(2.0)

_REGULARIZATION = 1e-3 * np.eye(6)  # chosen: 30 m and 30 rad; makes any information invertible


Move = Callable[[np.ndarray], np.ndarray]
"""Moves points, Nx3."""

_NO_POINTS = np.empty((0, 3))


@dataclass(frozen=True, eq=False)
class Residuals:
    """
    Residuals in units of their standard deviation.

    :param values: N.
    :param jacobian: Nx6, by the error of the pose.
    :param weights: N robust weights, 0 to 1.
    :param blocks: N, number of the block of the image that each residual is from.
    :param points: Nx3, the points of the source moved into the target [m]; of depth only.
    :param directions: Nx3, derivatives of the residuals by these points; of depth only.
    """

    values: np.ndarray
    jacobian: np.ndarray
    weights: np.ndarray
    blocks: np.ndarray
    points: np.ndarray = field(default_factory=lambda: _NO_POINTS)
    directions: np.ndarray = field(default_factory=lambda: _NO_POINTS)

    def of_scaled_error(self, rate: float) -> Residuals:
        """Return the residuals of a pose whose error acts on them multiplied by a rate."""
        return replace(self, jacobian=rate * self.jacobian)


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """
    Normal equations of a linear least-squares problem in the error of a pose.

    :param information: 6x6.
    :param gradient: 6, half the derivative of the weighted sum of squares.
    """

    information: np.ndarray
    gradient: np.ndarray

    @classmethod
    def of(cls, kinds: Iterable[Residuals]) -> NormalEquations:
        """Return the sum over residuals of several kinds."""
        information, gradient = np.zeros((6, 6)), np.zeros(6)
        for kind in kinds:
            weighted = kind.jacobian * kind.weights[:, None]
            information += weighted.T @ kind.jacobian
            gradient += weighted.T @ kind.values
        return cls(information, gradient)

    def __add__(self, other: NormalEquations) -> NormalEquations:
        """Return the normal equations of both problems together."""
        return NormalEquations(self.information + other.information,
                               self.gradient + other.gradient)

    def weighted(self, weight: float) -> NormalEquations:
        """Return the normal equations of residuals with a weight."""
        return NormalEquations(weight * self.information, weight * self.gradient)

    def damping(self, covariance: np.ndarray) -> np.ndarray:
        """
        Return what a bias of the pose that the residuals see multiplies the equations by, 6x6.

        So they become those of the pose with the bias marginalised.

        :param covariance: of the bias, in the error of the pose, 6x6.
        """
        return np.linalg.inv(np.eye(6) + self.information @ covariance)

    def damped(self, damping: np.ndarray) -> NormalEquations:
        """Return the normal equations multiplied by a :meth:`damping`."""
        return NormalEquations(damping @ self.information, damping @ self.gradient)


def gradient_noise(kinds: Iterable[Residuals]) -> np.ndarray:
    """
    Return the empirical covariance of the gradient, 6x6.

    Residuals of one block of the image may have a common error, so each block counts as one
    sample (cluster-robust, Liang and Zeger 1986), with the usual correction for few samples.
    """
    noise = np.zeros((6, 6))
    for kind in kinds:
        gradients = kind.jacobian * (kind.weights * kind.values)[:, None]
        sums = np.stack([np.bincount(kind.blocks, column) for column in gradients.T])
        blocks = int(np.count_nonzero(np.bincount(kind.blocks)))
        noise += sums @ sums.T * (blocks / max(blocks - 6, 1)) * (blocks / max(blocks - 7, 1))
    return noise


def _blocks(rays: np.ndarray) -> np.ndarray:
    """Return the number of the block of the image in which each ray lies, N."""
    u, v = ((np.clip(rays, -_RAY_LIMIT, _RAY_LIMIT) + _RAY_LIMIT) / _BLOCK).astype(np.intp).T
    numbers: np.ndarray = u * _BLOCKS_ACROSS + v
    return numbers


def geman_mcclure(squares: np.ndarray, width: float) -> np.ndarray:
    """
    Return the weights of Geman and McClure's cost (1985) for squared residuals.

    :param width: residual, in standard deviations, whose weight is a quarter.
    """
    weights: np.ndarray = 1.0 / (1.0 + squares / width ** 2) ** 2
    return weights


def robust_weights(squares: np.ndarray, width: float, typical: float = _MEDIAN_1) -> np.ndarray:
    """
    Return the weights of residuals of which at most half are outliers.

    Errors of calibration and shutter, which the noise model lacks, enlarge all residuals of some
    pairs of frames. The width grows with their median, so that a few consistent residuals cannot
    outweigh the rest.

    :param squares: of the whitened residuals.
    :param width: in standard deviations of the noise, or of the residuals if these are larger.
    :param typical: median of the squares if noise alone causes them.
    """
    if len(squares) == 0:
        return squares
    scale = min(max(median(squares) / typical, 1.0), _LARGEST_SCALE ** 2)
    return geman_mcclure(squares, width * math.sqrt(scale))


def reprojection(tracks: Tracks, T_target_source: np.ndarray, ray_sigma: float,
                 width: float) -> Residuals:
    """
    Return the reprojection errors of the tracks.

    Their noise is that of the image and, along the epipolar line, that of the source's depth.

    :param ray_sigma: standard deviation of a track on the plane z = 1.
    :returns: two residuals per track: the first coordinates of all, then the second ones.
    """
    a, b, c = arms = T_target_source[:3, :3] @ tracks.points.T
    x, y, z = arms + T_target_source[:3, 3:]
    x, y, inverse = x / z, y / z, 1 / z
    # of both coordinates: the error, and the derivatives by the moved point
    rows = np.zeros((2, 4, len(z)))
    rows[:, 0] = (x, y) - tracks.rays.T
    rows[0, 1] = rows[1, 2] = inverse
    rows[:, 3] = -x * inverse, -y * inverse
    # whiten by S^(-1/2), S = ray_sigma^2 I + s s^T, s the effect of one sigma of inverse depth
    s = np.array([a - c * x, b - c * y]) * (tracks.sigmas * tracks.points[:, 2] * inverse)
    square = s[0] * s[0] + s[1] * s[1]
    shrink = (1.0 - ray_sigma / np.sqrt(ray_sigma ** 2 + square)) / np.maximum(square, 1e-30)
    rows -= s[:, None] * (shrink * (s[0] * rows[0] + s[1] * rows[1]))
    rows /= ray_sigma
    values = rows[:, 0]
    weights = robust_weights(values[0] ** 2 + values[1] ** 2, width, _MEDIAN_2)
    jacobian = np.concatenate([_jacobian(row[1:], arms) for row in rows], axis=1)
    return Residuals(values.ravel(), jacobian.T, np.tile(weights, 2),
                     np.tile(_blocks(tracks.rays), 2))


def track_depth(tracks: Tracks, T_target_source: np.ndarray, sensor: SensorSettings,
                width: float) -> Residuals:
    """
    Return the errors of inverse depth at the tracks for which the target measures a depth.

    Corners lie on edges, where the error of a depth is far larger than on a surface.
    """
    measured = np.flatnonzero(np.isfinite(tracks.depths))
    arms = T_target_source[:3, :3] @ tracks.points.take(measured, 0).T
    z = arms[2] + T_target_source[2, 3]
    sigma = _CORNER_NOISE * inverse_depth_sigma(z, sensor)
    values = (1 / tracks.depths[measured] - 1 / z) / sigma
    directions = np.zeros_like(arms)
    directions[2] = 1 / (sigma * z ** 2)
    return Residuals(values, _jacobian(directions, arms).T, robust_weights(values ** 2, width),
                     _blocks(tracks.rays[measured]))


def point_to_plane(source: Surface, target: Surface, T_target_source: np.ndarray,
                   sensor: SensorSettings, width: float, reach: float,
                   undo: Move | None = None) -> Residuals:
    """
    Return the distances of the source's chosen points from the planes of the target.

    A point is associated to the cell it projects to (Blais and Levine 1995). Neighbouring cells
    share much of their noise, so averaging does not reduce it: it is taken as that of one pixel.
    To it is added what the two cells differ from planes, as what is averaged over their relief
    changes with the view.

    :param reach: pairs with a larger distance are dropped [m].
    :param undo: moves points of the target's camera to where its depth image has them.
    """
    # take() gathers rows several times as fast as indexing does
    rotation = T_target_source[:3, :3]
    arms = rotation @ source.points.take(source.chosen, 0).T
    moved = arms + T_target_source[:3, 3:]
    if undo is not None:
        moved = undo(moved.T).T
    seen, cells = target.cells_at(moved.T)
    arms, moved = arms.take(seen, 1), moved.take(seen, 1)
    normals = np.array(target.normals.take(cells, 0).T, np.float64, order='C')
    rotated = rotation @ source.normals.take(source.chosen.take(seen), 0).T
    distances = _products(moved - target.points.take(cells, 0).T, normals)
    kept = np.flatnonzero((np.abs(distances) < reach)
                          & (_products(rotated, normals) > _SMALLEST_COSINE))
    arms, moved, normals, rotated = (
        columns.take(kept, 1) for columns in (arms, moved, normals, rotated))
    # an error sigma of inverse depth moves a point p by sigma z p
    z = moved[2]
    relief = (target.roughness.take(cells.take(kept)) ** 2
              + source.roughness.take(source.chosen.take(seen.take(kept))) ** 2) / 2
    noise = (SURFACE_NOISE * inverse_depth_sigma(z, sensor)) ** 2
    sigmas = np.sqrt(noise + relief) * z * _products(moved, normals)
    values = distances.take(kept) / sigmas
    jacobian, other = (_jacobian(n / sigmas, arms).T for n in (normals, rotated))
    return Residuals(values, jacobian @ _observable_projection(jacobian, other),
                     robust_weights(values ** 2, width), _blocks((moved[:2] / z).T),
                     moved.T, jacobian[:, :3])


def _products(vectors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the dot products of the columns, N."""
    products: np.ndarray = np.einsum('ij,ij->j', vectors, others)
    return products


def _jacobian(directions: np.ndarray, arms: np.ndarray) -> np.ndarray:
    """
    Return the derivatives of residuals by the error of the pose, 6xN: (n, arm x n).

    :param directions: n, derivatives by the moved points, 3xN.
    :param arms: the points rotated but not translated by the pose, 3xN.
    """
    jacobian = np.empty((6, arms.shape[1]))
    (x, y, z), (a, b, c) = arms, directions
    jacobian[:3] = directions
    jacobian[3], jacobian[4], jacobian[5] = y * c - z * b, z * a - x * c, x * b - y * a
    return jacobian


def _observable_projection(jacobian: np.ndarray, other: np.ndarray) -> np.ndarray:
    """
    Return the projection of pose errors onto the directions that the residuals observe.

    Noise of the normals makes a wall look rough, as if its points could observe a motion along
    it. The two measurements of the Jacobian have independent noise, so J^T J contains
    D^T D / 2 of noise, D being their difference.

    :param jacobian: Nx6, with normals of the target.
    :param other: Nx6, with normals of the source.
    :returns: 6x6; the identity where all directions are observed.
    """
    difference = jacobian - other
    root = np.linalg.cholesky(jacobian.T @ jacobian + _REGULARIZATION)
    noise = np.linalg.solve(root, difference.T @ difference / 2)
    shares, directions = np.linalg.eigh(np.linalg.solve(root, noise.T))
    observed = np.sqrt(np.clip((_SHARE_UNOBSERVED - shares)
                               / (_SHARE_UNOBSERVED - _SHARE_OBSERVED), 0.0, 1.0))
    projection: np.ndarray = (np.linalg.solve(root.T, directions * observed)
                              @ directions.T @ root.T)
    return projection
