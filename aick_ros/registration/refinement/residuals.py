# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Whitened residuals of a pose with their Jacobians: one function per kind of residual.

Their weights are robust (:mod:`.robust_weights`). The Jacobians are with respect to the pose error
of :mod:`aick_ros.geometry.se3`: [R p] becomes [exp(theta) R, p + delta], columns (delta, theta).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from aick_ros import kernels
from aick_ros.frames import depth
from aick_ros.frames.surface import Surface
from aick_ros.registration.refinement.misalignment import NO_CORRECTION, Correction
from aick_ros.registration.refinement.robust_weights import (
    LARGEST_SCALE, MEDIAN_1, MEDIAN_2, robustness, truncation)
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks
from aick_ros.settings import SensorSettings

SURFACE_NOISE = 1.4
"""Noise of a depth on a smooth surface, as a ratio to the sensor model. Chosen."""

_CORNER_NOISE = 10.0  # chosen: the same ratio at a corner, where depths have edges
_SMALLEST_COSINE = 0.8  # chosen: between the normals of a point and of its plane
_SHARE_OBSERVED, _SHARE_UNOBSERVED = 0.25, 0.75
"""Share of noise in the information about a direction, chosen.

Up to the first the direction counts as observed, from the second as not, linearly in between.
"""

_LEAST_CURVATURE = 0.2
"""Smallest ratio of :func:`curvature`; chosen: noise has 0.57 at least, and outliers alone any."""

_CLEARLY = 4.0  # chosen: ratio of the squared errors from which on a track is of the smaller one
_LEAST_ERROR = 0.25 ** 2  # chosen: smaller squared errors are taken as equal

PRIOR = np.eye(6)
"""Information of a weak prior about a pose, chosen: standard deviations of 1 m and 1 rad.

Keeps finite what no residual observes.
"""

_RIDGE = 1e-3  # chosen: 30 m and 30 rad; makes any information invertible
_NONE = np.zeros((6, 6))


@dataclass(frozen=True, eq=False)
class Residuals:
    """
    Residuals in units of their standard deviation.

    :param values: N.
    :param jacobian: Nx6, by the error of the pose.
    :param weights: N robust weights, 0 to 1.
    :param blocks: N, number of the block of the image that each residual is from.
    :param dimensions: of a measurement: as many residuals have one weight, by their length.
    """

    values: np.ndarray
    jacobian: np.ndarray
    weights: np.ndarray
    blocks: np.ndarray
    dimensions: int = field(default=1, kw_only=True)


@dataclass(frozen=True, eq=False)
class PlaneResiduals(Residuals):
    """
    Distances of points from planes, in units of their standard deviation.

    :param points: Nx3, the points of the source moved into the target [m].
    :param directions: Nx3, derivatives of the residuals by these points.
    :param normal_noise: 6x6, what noise of the normals adds to ``jacobian.T @ jacobian``.
    """

    points: np.ndarray
    directions: np.ndarray
    normal_noise: np.ndarray = field(default_factory=lambda: _NONE)


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
    def of(cls, kinds: Iterable[Residuals], prior: np.ndarray = _NONE) -> NormalEquations:
        """
        Return the sum over residuals of several kinds.

        :param prior: information that is added, 6x6.
        """
        information, gradient = prior.copy(), np.zeros(6)
        for kind in kinds:
            kernels.normal_equations(kind.jacobian, kind.values, kind.weights, information,
                                     gradient)
        return cls(information, gradient)


def gradient_noise(kinds: Iterable[Residuals]) -> np.ndarray:
    """
    Return the empirical covariance of the gradient, 6x6.

    Residuals of one block of the image may have a common error, so each block counts as one
    sample (cluster-robust, Liang and Zeger 1986), with the usual correction for few samples.
    """
    noise = np.zeros((6, 6))
    for kind in kinds:
        kernels.gradient_noise(kind.jacobian, kind.values, kind.weights, kind.blocks, noise)
    return noise


def curvature(kinds: Iterable[Residuals]) -> float:
    """
    Return how much the robust cost is curved, as a ratio to what its weights let expect.

    A residual that grows loses weight, so that its weighted value grows by less: for the weights w
    of Geman and McClure by 4 w^1.5 - 3 w. If it is a vector, that is so along it, and by w across
    it. The ratio of the sums makes the covariance of a pose by normal equations with such weights
    that of an M-estimate (Huber 1981, section 7.6).
    """
    total = lost = 0.0
    for kind in kinds:
        weights = kind.weights
        total += float(weights.sum())
        lost += 4.0 * float((weights - weights * np.sqrt(weights)).sum()) / kind.dimensions
    return max(1.0 - lost / total, _LEAST_CURVATURE) if total else 1.0


def reprojection(tracks: Tracks, T_target_source: np.ndarray, ray_sigma: float, width: float,
                 wider: float = 1.0) -> Residuals:
    """
    Return the reprojection errors of the tracks.

    Their noise is that of the image and, along the epipolar line, that of the source's depth.
    Tracks so far off that they must be on an object that moves by itself have no weight.

    :param ray_sigma: standard deviation of a track on the plane z = 1.
    :param width: of the robust weights, in standard deviations.
    :param wider: how many times as wide they are. What is another motion's is so by the width
        itself.
    :returns: two residuals per track: the first coordinates of all, then the second ones.
    """
    count = len(tracks)
    values, jacobian, weights = np.empty(2 * count), np.empty((2 * count, 6)), np.empty(2 * count)
    blocks = np.empty(2 * count, np.int64)
    kernels.reprojection(
        tracks.points, tracks.rays, tracks.sigmas, T_target_source, ray_sigma,
        robustness(wider * width, MEDIAN_2), truncation(width), values, jacobian, weights,
        blocks)
    return Residuals(values, jacobian, weights, blocks, dimensions=2)


def squared_errors(errors: Residuals) -> np.ndarray:
    """Return the squared reprojection errors of tracks, K, by those of :func:`reprojection`."""
    squares: np.ndarray = np.square(errors.values.reshape(2, -1)).sum(axis=0)
    return squares


def are_far_smaller(squares: np.ndarray | float, others: np.ndarray) -> np.ndarray:
    """Return where squared errors, in units of their variance, are far smaller than others."""
    far_smaller: np.ndarray = others > _CLEARLY * np.maximum(squares, _LEAST_ERROR)
    return far_smaller


def track_depth(tracks: Tracks, T_target_source: np.ndarray, sensor: SensorSettings,
                width: float) -> Residuals:
    """
    Return the errors of inverse depth at the tracks for which the target measures a depth.

    Corners lie on edges, where the error of a depth is far larger than on a surface.
    """
    count = len(tracks)
    values, jacobian, weights = np.empty(count), np.empty((count, 6)), np.empty(count)
    blocks = np.empty(count, np.int64)
    found = kernels.track_depth(
        tracks.points, tracks.rays, tracks.depths, T_target_source,
        depth.noise(sensor, _CORNER_NOISE), robustness(width, MEDIAN_1), values, jacobian,
        weights, blocks)
    return Residuals(values[:found], jacobian[:found], weights[:found], blocks[:found])


def track_steps(tracks: Tracks, T_target_source: np.ndarray, ray_sigma: float,
                sensor: SensorSettings, width: float, wider: Sequence[float], weight: float,
                others: NormalEquations) -> tuple[np.ndarray, np.ndarray]:
    """
    Return a pose after Gauss-Newton steps by both kinds of residuals of tracks, and the last step.

    They are those of :func:`reprojection` and :func:`track_depth`.

    :param width: of the robust weights, in standard deviations.
    :param wider: how many times as wide they are in each step.
    :param weight: of these residuals.
    :param others: what is added to their normal equations; with them they are definite.
    :returns: 4x4, and 6.
    """
    step, pose = np.empty(6), np.empty((4, 4))
    kernels.track_steps(
        tracks.points, tracks.rays, tracks.sigmas, tracks.depths, T_target_source,
        ray_sigma, depth.noise(sensor, _CORNER_NOISE), np.array(wider),
        robustness(width, MEDIAN_2), robustness(width, MEDIAN_1), truncation(width), weight,
        others.information, others.gradient, step, pose)
    return pose, step


def contradict(residuals: Residuals) -> bool:
    """
    Return whether most residuals, of one number each, are larger than those of a right pose are.

    The depths of two images that show the same, and nevertheless differ so, do not belong to what
    the images show: those of one of the frames are wrong.
    """
    are_large = residuals.values ** 2 > LARGEST_SCALE ** 2 * MEDIAN_1
    return (len(are_large) >= FEWEST_TO_CONFIRM
            and bool(2 * np.count_nonzero(are_large) > len(are_large)))


def point_to_plane(source: Surface, target: Surface, T_target_source: np.ndarray,
                   sensor: SensorSettings, width: float, reach: float,
                   correction: Correction = NO_CORRECTION, rate: float = 1.0,
                   every: int = 1,
                   smallest_cosine: float = _SMALLEST_COSINE) -> PlaneResiduals:
    """
    Return the distances of the source's chosen points from the planes of the target.

    A point is associated to the cell it projects to (Blais and Levine 1995). Neighbouring cells
    share much of their noise, so averaging does not reduce it: it is taken as that of one pixel.
    To it is added what the two cells differ from planes, as what is averaged over their relief
    changes with the view.

    :param reach: pairs with a larger distance are dropped [m].
    :param correction: of what both frames see.
    :param rate: time between the depth images, as a ratio to that which the motion of the pose
        takes; the Jacobian is by the error of the whole motion.
    :param every: one of how many of the chosen points is taken.
    :param smallest_cosine: between the normals of a point and of its plane.
    """
    chosen = source.chosen[::every]
    count = len(chosen)
    values, weights, blocks = np.empty(count), np.empty(count), np.empty(count, np.int64)
    jacobian, (points, directions) = np.empty((count, 6)), np.empty((2, count, 3))
    sums = np.zeros((2, 6, 6))
    found, is_observed = kernels.point_to_plane(
        source.points, chosen, source.normals, source.roughness,
        correction.source.twists, correction.source.height, T_target_source, rate,
        correction.target.twists, correction.target.height, correction.depth_focal,
        target.points, target.normals, target.usable, target.roughness, target.grid.width,
        target.grid.height, target.grid.intrinsics, depth.noise(sensor, SURFACE_NOISE),
        robustness(width, MEDIAN_1), reach, smallest_cosine, _SHARE_OBSERVED, _RIDGE,
        values, jacobian, weights, points, directions, blocks, sums)
    jacobian, noise = jacobian[:found], sums[1]
    if not is_observed:
        projection = _observable_projection(*sums)
        jacobian, noise = jacobian @ projection, projection.T @ noise @ projection
    return PlaneResiduals(values[:found], jacobian, weights[:found], blocks[:found],
                          points[:found], directions[:found], noise)


def _observable_projection(information: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """
    Return the projection of pose errors onto the directions that the residuals observe.

    Noise of the normals makes a wall look rough, as if its points could observe a motion along
    it. The two measurements of the Jacobian have independent noise, so J^T J contains
    D^T D / 2 of noise, D being their difference.

    :param information: J^T J, 6x6.
    :param noise: in it, 6x6.
    :returns: 6x6; the identity where all directions are observed.
    """
    return _projection(information + _RIDGE * np.eye(6), noise, _share_observed)


def unobservable_projection(information: np.ndarray, noise: np.ndarray) -> np.ndarray | None:
    """
    Return the projection onto the directions that the residuals do not observe.

    :param information: of residuals whose Jacobian is projected, 6x6.
    :param noise: in it, 6x6; with what is projected away all is noise.
    :returns: 6x6; None where all directions are observed.
    """
    ridge = _RIDGE * np.eye(6)
    projection = _projection(information + ridge, noise + ridge,
                             lambda shares: 1.0 - _share_observed(shares))
    return projection if projection.any() else None


def _share_observed(shares: np.ndarray) -> np.ndarray:
    """Return how far directions count as observed, by the share of noise in the information."""
    observed: np.ndarray = np.clip((_SHARE_UNOBSERVED - shares)
                                   / (_SHARE_UNOBSERVED - _SHARE_OBSERVED), 0.0, 1.0)
    return observed


def _projection(information: np.ndarray, noise: np.ndarray,
                weight: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the projection that weights the information by the share of noise in it, 6x6."""
    root = np.linalg.cholesky(information)
    shares, directions = np.linalg.eigh(
        np.linalg.solve(root, np.linalg.solve(root, noise).T))
    projection: np.ndarray = (np.linalg.solve(root.T, directions * np.sqrt(weight(shares)))
                              @ directions.T @ root.T)
    return projection
