# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The depth of a frame and of a view that shows the same."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.depth_edges import DepthEdges
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import definite
from aick_ros.geometry.pose import in_axes
from aick_ros.registration.edge_distances import edge_distances
from aick_ros.registration.refinement.misalignment import Correction
from aick_ros.registration.refinement.residuals import (
    NormalEquations, PlaneResiduals, Residuals, curvature, gradient_noise, point_to_plane,
    unobservable_projection)
from aick_ros.settings import Settings

_SMALLEST_FACTOR = 0.01  # chosen: floor of the variance, as a ratio to that by the sensor's noise
_LARGEST_RESIDUAL = 4.0  # chosen: in standard deviations of the noise, of a point on its plane
_ROUNDING = 1e-13  # of information, as a ratio to the largest about any direction; chosen
_ANY_COSINE = 0.0  # chosen: of the normals of points that show how well the two frames agree
_LEAST_SHARE = 0.1  # chosen: of the information that is left, whatever the noise of the normals


_EDGE_WEIGHT = 0.08
"""Weight of the distance of an edge point: its neighbours err alike. Chosen on rendered rooms with
three kinds of cameras: up to it what planes observe is as exact as without edges."""

_EDGE_DESIGN_EFFECT = 4.0
"""Variance of edges, as a ratio to that by their scatter between parts of the image: an object has
few edges, all of which are displaced alike. Chosen on two rendered rooms."""


@dataclass(frozen=True, eq=False)
class KnownView:
    """
    A frame whose pose beside another one is known.

    :param T_view_target: pose of the other one in this frame, 4x4.
    """

    prepared: PreparedFrame
    T_view_target: np.ndarray


@dataclass(frozen=True, eq=False)
class DepthPair:
    """
    What the depth of a frame and of a view says about the pose of the frame in a target.

    Planes hold the camera, and edges where the planes do not: along a wall.

    :param source: surface of the frame; ``view``: that of the view.
    :param T_view_target: pose of the target in the view, 4x4; the identity where they are the
        same.
    :param correction: of both, by their motion and the misalignment of the camera.
    :param weight: beside other pairs of the frame.
    :param every: one of how many of the frame's points counts. The others are its neighbours,
        which share much of its noise: they make the pose better, but no more certain.
    :param edges: of the frame and of the view; None: by planes alone.
    :param hidden: projection of pose errors onto what the planes do not observe, 6x6; None:
        nothing, so that edges have no part.
    """

    source: Surface
    view: Surface
    T_view_target: np.ndarray
    correction: Correction
    settings: Settings
    weight: float = 1.0
    every: int = 1
    edges: tuple[DepthEdges, DepthEdges] | None = None
    hidden: np.ndarray | None = None

    def hidden_near(self, T_target_source: np.ndarray) -> np.ndarray | None:
        """Return the projection onto what the planes do not observe near a pose, 6x6, if any."""
        return _hidden_by(self._residuals(self.T_view_target @ T_target_source, self.every))

    def with_edges(self, edges: tuple[DepthEdges, DepthEdges],
                   T_target_source: np.ndarray) -> DepthPair:
        """Return the pair with the edges of the frame and of the view, near a pose."""
        return replaced(self, edges=edges, hidden=self.hidden_near(T_target_source))

    def overlap(self, T_target_source: np.ndarray) -> float:
        """Return the share of the frame's points that lie on planes of the view."""
        residuals = self._residuals(self.T_view_target @ T_target_source,
                                    smallest_cosine=_ANY_COSINE)
        on_planes = np.abs(residuals.values) < _LARGEST_RESIDUAL
        return float(np.count_nonzero(on_planes)) / len(self.source.chosen)

    def equations(self, T_target_source: np.ndarray, with_all: bool = True) -> NormalEquations:
        """
        Return the normal equations in the error of the pose of the frame in the target.

        :param with_all: with all points of the frame, or with those that count alone.
        """
        T_view_source = self.T_view_target @ T_target_source
        planes = self._residuals(T_view_source, 1 if with_all else self.every)
        by_planes, axes = NormalEquations.of([planes]), in_axes(self.T_view_target[:3, :3])
        by_edges = NormalEquations.of(self._edges(T_view_source, self.hidden))
        share = 1.0 / self.every if with_all else 1.0
        weighted = self.weight * axes.T
        return NormalEquations(
            weighted @ (share * by_planes.information + by_edges.information) @ axes,
            weighted @ (share * by_planes.gradient + by_edges.gradient))

    def covariance(self, T_view_source: np.ndarray, unobserved: np.ndarray) -> np.ndarray:
        """
        Return the covariance A^-1 B A^-1 of the pose in the view by this pair alone, 6x6.

        A is the curvature of the robust cost, without what noise of the normals adds to it, as a
        point that moves along a wall is paired with other normals. B has the scatter of the
        residuals, of points whichever way they face: where depth is noisy few face as their planes
        do, and those by chance. Velocities are wrong by the same error for many frames, so the
        motion expected from frame to frame holds the solution together, but does not make it more
        certain.

        :param unobserved: 6x6, the covariance of what no surface shows.
        """
        residuals = self._residuals(T_view_source, smallest_cosine=_ANY_COSINE)
        by_planes, scale = NormalEquations.of([residuals]), curvature([residuals]) / self.every
        edges = self._edges(T_view_source, _hidden_by(residuals))
        information = (scale * by_planes.information
                       + curvature(edges) * NormalEquations.of(edges).information)
        scatter = (gradient_noise([residuals]) / self.every ** 2
                   + _EDGE_DESIGN_EFFECT * gradient_noise(edges) + _SMALLEST_FACTOR * information)
        of_normals = scale * float(residuals.weights.mean()) * residuals.normal_noise
        shown, axes = np.linalg.eigh(information)
        is_shown = shown > _ROUNDING * shown[-1]

        def along_axes(matrix: np.ndarray) -> np.ndarray:
            """Return a matrix in these axes: nothing where no surface shows anything."""
            return np.where(np.outer(is_shown, is_shown), axes.T @ matrix @ axes, 0.0)

        prior = axes.T @ np.linalg.inv(unobserved) @ axes
        inverse = np.linalg.inv(_less(np.where(is_shown, shown, 0.0), along_axes(of_normals))
                                + prior)
        covariance = axes @ inverse @ (along_axes(scatter) + prior) @ inverse @ axes.T
        return definite.nonnegative(0.5 * (covariance + covariance.T))

    def _edges(self, T_view_source: np.ndarray, hidden: np.ndarray | None) -> list[Residuals]:
        """Return the distances of the frame's edges, with their weight, where they have a part."""
        if self.edges is None or hidden is None:
            return []
        distances = edge_distances(*self.edges, self.correction.pose_by_depth(T_view_source))
        root = math.sqrt(_EDGE_WEIGHT)
        return [replaced(distances, values=root * distances.values,
                         jacobian=root * distances.jacobian @ hidden)]

    def _residuals(self, T_view_source: np.ndarray, every: int = 1,
                   **options: float) -> PlaneResiduals:
        """Return the distances of the frame's points from planes of the view, whitened."""
        refinement = self.settings.refinement
        return point_to_plane(
            self.source, self.view, T_view_source, self.settings.sensor, refinement.robust_width,
            refinement.reach, self.correction, every=every, **options)


def _hidden_by(planes: PlaneResiduals) -> np.ndarray | None:
    if not len(planes.weights):
        return None
    return unobservable_projection(NormalEquations.of([planes]).information,
                                   float(planes.weights.mean()) * planes.normal_noise)


def _less(shown: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """
    Return information less the noise in it, KxK.

    :param shown: K, the information along each axis; zero where there is none, nor noise.
    :param noise: KxK.
    """
    roots = np.sqrt(shown)
    per_root = np.divide(1.0, roots, out=np.zeros_like(roots), where=shown > 0.0)
    shares, axes = np.linalg.eigh(per_root[:, None] * noise * per_root)
    axes = roots[:, None] * axes
    less: np.ndarray = axes * np.clip(1.0 - shares, _LEAST_SHARE, 1.0) @ axes.T
    return less
