# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Normal equations of a camera's misalignment, by the residuals of one registration.

The derivative of a residual by the point that it is of, times how the misalignment moves this
point, is its derivative by the misalignment. Points of the depth image move anyhow. A keypoint
keeps its ray: a surface that moves changes its depth alone; during the readout it moves anyhow.
A distortion of the depth image moves its points along their rays; what it does to keypoints is
far less, and left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.frames.depth_distortion import COLUMNS, ROWS, nodes_around
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import definite
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.refinement.residuals import Residuals
from aick_ros.registration.refinement.tracks import Tracks

_EVERY = 4  # chosen: of so many depth residuals one is used; neighbours are correlated
_SMALLEST_COSINE = 0.2  # chosen: of a ray to a normal; more grazing surfaces count as this
_PRIOR = np.eye(6)  # chosen, as in the refinement: 1 m and 1 rad


@dataclass(frozen=True, eq=False)
class Equations:
    """
    Normal equations of N unknowns.

    :param information: NxN.
    :param gradient: N, information times the values that explain the residuals best.
    """

    information: np.ndarray
    gradient: np.ndarray

    def without_pose(self) -> Equations:
        """Return those of the others, where the first six unknowns are the error of a pose."""
        information, gradient = self.information, self.gradient
        gains = definite.solve(information[:6, :6] + _PRIOR, information[:6, 6:]).T
        return Equations(information[6:, 6:] - gains @ information[:6, 6:],
                         gradient[6:] - gains @ gradient[:6])


@dataclass(frozen=True, eq=False)
class MisalignmentSample:
    """
    Normal equations of the misalignment by one registration, its pose eliminated.

    :param information: 8x8, in the order of :attr:`Misalignment.values`.
    :param gradient: 8, information times the values that explain the residuals best.
    :param with_distortion: of the misalignment, and behind it the distortion of the depth image
        at its nodes; None: not made.
    """

    information: np.ndarray
    gradient: np.ndarray
    with_distortion: Equations | None = None


@dataclass(frozen=True, eq=False)
class Motion:
    """
    A pair of frames and how their cameras move.

    :param T_target_source: 4x4.
    :param twists: 2x6, body velocities of the source and of the target [m/s, rad/s].
    :param heights: 2, of both images on the plane z = 1.
    """

    T_target_source: np.ndarray
    twists: np.ndarray
    heights: np.ndarray


@dataclass(frozen=True, eq=False)
class DistortionRows:
    """
    How the distortion of the depth images changes residuals of depth.

    :param jacobian: NxM, by the distortion at the nodes.
    :param applied: N, how far the residuals are changed by what is corrected already.
    """

    jacobian: np.ndarray
    applied: np.ndarray


_Rows = tuple[np.ndarray, np.ndarray, np.ndarray]


def misalignment_sample(keypoints: _Rows, depth: _Rows, applied: Misalignment,
                        distortion: DistortionRows | None = None) -> MisalignmentSample:
    """
    Return the normal equations of the misalignment, with the pose eliminated.

    :param keypoints: Jacobian by pose and misalignment, Nx14, values and weights, N each.
    :param depth: the same of depth.
    :param applied: misalignment that the residuals are already corrected by.
    :param distortion: rows of the residuals of depth; None: it is not sought.
    """
    information, gradient = np.zeros((14, 14)), np.zeros(14)
    for jacobian, values, weights in (keypoints, depth):
        weighted = jacobian * weights[:, None]
        information += weighted.T @ jacobian
        gradient -= weighted.T @ values
    alone = Equations(information, gradient)
    reduced = alone.without_pose()
    joint = None if distortion is None else _with_distortion(alone, depth, distortion, applied)
    return MisalignmentSample(
        reduced.information, reduced.gradient + reduced.information @ applied.values, joint)


def _with_distortion(alone: Equations, depth: _Rows, distortion: DistortionRows,
                     applied: Misalignment) -> Equations:
    """Return equations of pose and misalignment with the distortion as well, without the pose."""
    jacobian, values, weights = depth
    by_nodes = distortion.jacobian
    weighted = by_nodes * weights[:, None]
    between = jacobian.T @ weighted
    undone = weights * distortion.applied
    known = len(alone.gradient)
    information = np.empty((known + by_nodes.shape[1],) * 2)
    information[:known, :known] = alone.information
    information[:known, known:] = between
    information[known:, :known] = between.T
    information[known:, known:] = by_nodes.T @ weighted
    reduced = Equations(information, np.concatenate([
        alone.gradient + jacobian.T @ undone,
        weighted.T @ (distortion.applied - values)])).without_pose()
    known = reduced.information[:, :len(applied.values)] @ applied.values
    return Equations(reduced.information, reduced.gradient + known)


def keypoint_rows(residuals: Residuals, tracks: Tracks, surface: Surface, motion: Motion,
                  weight: float) -> _Rows:
    """
    Return the Jacobian, values and weights of the keypoints on a smooth surface of the source.

    :param residuals: two per track, as :func:`reprojection` returns them.
    """
    seen, cells = surface.cells_at(tracks.points)
    rows = np.empty((2 * len(seen), 14))
    kernels.keypoint_rows(
        tracks.points, seen, cells, surface.normals, residuals.jacobian, motion.T_target_source,
        motion.twists, motion.heights, _SMALLEST_COSINE, rows)
    both = np.concatenate([seen, seen + len(tracks)])
    return rows, residuals.values[both], weight * residuals.weights[both]


def depth_rows(residuals: Residuals, motion: Motion) -> _Rows:
    """Return the Jacobian, values and weights of some of the depth residuals."""
    points, directions, jacobian = _some(residuals)
    rows = np.empty((len(points), 14))
    kernels.depth_rows(points, directions, jacobian, motion.T_target_source, motion.twists,
                       motion.heights, rows)
    return rows, residuals.values[::_EVERY], _EVERY * residuals.weights[::_EVERY]


def distortion_rows(residuals: Residuals, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray) -> DistortionRows:
    """Return the rows of the distortion, of the residuals that :func:`depth_rows` is of."""
    moved, in_target, _ = _some(residuals)
    rotation, position = T_target_source[:3, :3], T_target_source[:3, 3]
    points, in_source = (moved - position) @ rotation, in_target @ rotation
    jacobian, applied = np.zeros((len(moved), ROWS * COLUMNS)), np.zeros(len(moved))
    for sign, seen, directions, frame in ((-1.0, points, in_source, source),
                                          (1.0, moved, in_target, target)):
        kernels.distortion_rows(seen, directions, *nodes_around(seen, frame.frame.camera), sign,
                                frame.distortion.nodes.ravel(), jacobian, applied)
    return DistortionRows(jacobian, applied)


def _some(residuals: Residuals) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points, directions and Jacobian of some of the depth residuals, evenly chosen."""
    points, directions, jacobian = (
        np.ascontiguousarray(rows[::_EVERY])
        for rows in (residuals.points, residuals.directions, residuals.jacobian))
    return points, directions, jacobian
