# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Normal equations of a camera's misalignment, by the residuals of one registration.

The derivative of a residual by the point that it is of, times how the misalignment moves this
point, is its derivative by the misalignment. Points of the depth image move anyhow. A keypoint
keeps its ray: a surface that moves changes its depth alone; during the readout it moves anyhow.
A distortion of the depth image moves its points along their rays; what it does to keypoints is
far less, and ignored.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.frames.depth_distortion import COLUMNS, ROWS
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import definite
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.refinement.residuals import PRIOR, PlaneResiduals, Residuals
from aick_ros.registration.samples import Equations, MisalignmentSample
from aick_ros.registration.tracks import Tracks

_EVERY = 4  # chosen: of so many depth residuals one is used; neighbours are correlated
_SMALLEST_COSINE = 0.2  # chosen: of a ray to a normal; more grazing surfaces count as this


@dataclass(frozen=True, eq=False)
class MovingPair:
    """
    A pair of frames and how their cameras move.

    :param surface: of the source.
    :param T_target_source: 4x4.
    :param twists: 2x6, body velocities of the source and of the target [m/s, rad/s].
    """

    source: PreparedFrame
    target: PreparedFrame
    surface: Surface
    T_target_source: np.ndarray
    twists: np.ndarray

    @property
    def cameras(self) -> tuple[np.ndarray, np.ndarray]:
        """Both, as the kernels take them."""
        return self.source.frame.camera.model, self.target.frame.camera.model


def misalignment_sample(keypoints: Residuals, depth: PlaneResiduals, tracks: Tracks,
                        pair: MovingPair, weight: float,
                        applied: Misalignment) -> MisalignmentSample | None:
    """
    Return the normal equations of the misalignment, with the pose eliminated.

    There are none where the residuals are not finite.

    :param keypoints: two residuals per track, as :func:`reprojection` returns them.
    :param depth: residuals of which some are used, evenly chosen.
    :param weight: of the keypoints.
    :param applied: misalignment that the residuals are already corrected by.
    """
    unknowns = 6 + len(applied.values) + ROWS * COLUMNS
    information, gradients = np.zeros((unknowns, unknowns)), np.zeros((2, unknowns))
    _add_keypoints(keypoints, tracks, pair, weight, information, gradients[0])
    _add_depth(depth, pair, information, gradients)
    without_pose = definite.eliminated(information, gradients, PRIOR)
    if without_pose is None:
        return None
    information, (by_values, by_applied) = without_pose
    known = len(applied.values)
    by_values += information[:, :known] @ applied.values
    return MisalignmentSample(information[:known, :known], by_values[:known],
                              Equations(information, by_values + by_applied))


def _add_keypoints(residuals: Residuals, tracks: Tracks, pair: MovingPair, weight: float,
                   information: np.ndarray, gradient: np.ndarray) -> None:
    """Add the equations of the keypoints on a smooth surface of the source."""
    surface = pair.surface
    kernels.keypoint_equations(
        tracks.points, *surface.cells_at(tracks.points), surface.normals, residuals.jacobian,
        residuals.values, residuals.weights, weight, pair.T_target_source, pair.twists,
        *pair.cameras, _SMALLEST_COSINE, information, gradient)


def _add_depth(residuals: PlaneResiduals, pair: MovingPair, information: np.ndarray,
               gradients: np.ndarray) -> None:
    """
    Add the equations of some of the depth residuals, with those of the distortion.

    :param gradients: by the residuals, and by how far the distortion applied has changed them.
    """
    kernels.depth_equations(
        residuals.points, residuals.directions, residuals.jacobian, residuals.values,
        residuals.weights, _EVERY, pair.T_target_source, pair.twists, *pair.cameras, ROWS, COLUMNS,
        pair.source.distortion.nodes, pair.target.distortion.nodes, information, gradients)
