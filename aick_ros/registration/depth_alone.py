# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Registration of two depth images where the colour images show too little.

Point-to-plane distances hold the camera in all directions in which the scene has shape: a room
with furniture in all six, a single wall along its normal and in two rotations. The rest is left
to the motion that is expected, with its covariance. The expected motion is part of the same
least-squares problem, so no threshold decides which directions count as observed.
"""

from __future__ import annotations

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.refinement import depth_rate
from aick_ros.registration.refinement.residuals import (
    NormalEquations, Residuals, gradient_noise, point_to_plane)
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.status import Status
from aick_ros.settings import Settings

_MOST_STEPS = 12  # chosen: planes are associated anew in each
_SMALLEST_STEP = 1e-4  # m and rad; chosen: a smaller step ends the iteration
_FEWEST_POINTS = 300  # chosen: with fewer the depth image has too many holes
_MIN_SHARE = 0.5  # chosen on rendered rooms: share of the points that must lie on a plane
_LARGEST_RESIDUAL = 4.0  # chosen: in standard deviations of the noise, of a point on its plane
_SMALLEST_FACTOR = 0.01  # chosen: floor of the variance, as a ratio to that by the sensor's noise


class DepthAlone:
    """
    Registers depth images to each other, from an expected pose.

    :param noise: of the camera; the bias between keypoints and depth is an error of such a pose.
    """

    def __init__(self, settings: Settings, noise: MeasuredNoise) -> None:
        self._settings = settings
        self._noise = noise

    def register(self, source: PreparedFrame, target: PreparedFrame,
                 expected: PoseWithCovariance, unobserved: np.ndarray) -> Registration:
        """
        Return the pose of the source in the target by depth and by the motion expected.

        It fails where too few points of the source lie on surfaces of the target.

        :param expected: ``T_target_source`` by the motion model since the last frame.
        :param unobserved: 6x6, the covariance of the pose if no frame had been registered since
            keypoints were last seen.
        """
        surface, other = source.surface, target.surface
        count = 0 if surface is None else len(surface.chosen)
        if surface is None or other is None or count < _FEWEST_POINTS:
            return failed(Status.TOO_FEW_KEYPOINTS, f'{count} points with depth')
        problem = _Problem(surface, other, expected, depth_rate(source, target), self._settings)
        pose = problem.solve()
        share = problem.share_on_planes(pose)
        reason = f'by depth alone, {share:.0%} of {count} points'
        if share < _MIN_SHARE:
            return failed(Status.TOO_FEW_MATCHES, reason)
        bias = self._noise.expected(
            _displacement(surface, pose, source.frame.camera.fx)).bias
        return Registration(
            Status.OK, reason, pose, problem.covariance(pose, unobserved) + bias,
            np.empty((0, 2), np.intp), 0, evidence=Evidence.DEPTH_ALONE)


class _Problem:
    """The least-squares problem of one pair of depth images."""

    def __init__(self, source: Surface, target: Surface, expected: PoseWithCovariance,
                 rate: float, settings: Settings) -> None:
        self._source, self._target, self._rate = source, target, rate
        self._expected = expected
        self._prior = np.linalg.inv(expected.covariance)
        self._sensor, self._settings = settings.sensor, settings.refinement

    def solve(self) -> np.ndarray:
        """Return the pose at the minimum, 4x4."""
        pose = self._expected.matrix
        for _ in range(_MOST_STEPS):
            equations = NormalEquations.of([self._residuals(pose)])
            deviation = se3.difference(pose, self._expected.matrix)
            step = -np.linalg.solve(equations.information + self._prior,
                                    equations.gradient + self._prior @ deviation)
            pose = se3.perturbed(pose, step)
            if np.abs(step).max() < _SMALLEST_STEP:
                break
        return pose

    def share_on_planes(self, pose: np.ndarray) -> float:
        """Return the share of the source's points that lie on planes of the target."""
        on_planes = np.abs(self._residuals(pose).values) < _LARGEST_RESIDUAL
        return float(np.count_nonzero(on_planes)) / len(self._source.chosen)

    def covariance(self, pose: np.ndarray, unobserved: np.ndarray) -> np.ndarray:
        """
        Return the covariance A^-1 B A^-1, 6x6; B has the scatter of the residuals.

        Velocities are wrong by the same error for many frames, so the motion expected from frame
        to frame holds the solution together, but does not make it more certain.
        """
        residuals = self._residuals(pose)
        information = NormalEquations.of([residuals]).information
        noise = gradient_noise([residuals]) + _SMALLEST_FACTOR * information
        prior = np.linalg.inv(unobserved)
        inverse = np.linalg.inv(information + prior)
        covariance: np.ndarray = inverse @ (noise + prior) @ inverse
        return covariance

    def _residuals(self, pose: np.ndarray) -> Residuals:
        return point_to_plane(
            self._source, self._target, se3.scaled(pose, self._rate), self._sensor,
            self._settings.robust_width, self._settings.reach).of_scaled_error(self._rate)


def _displacement(surface: Surface, pose: np.ndarray, focal_length: float) -> float:
    """Return how far a motion displaces the image of a surface in the mean [px]."""
    points = surface.points.take(surface.chosen, 0).astype(np.float64)
    moved = se3.transform(pose, points)
    moved, points = moved[moved[:, 2] > 0], points[moved[:, 2] > 0]
    if not len(points):
        return 0.0
    shifts = moved[:, :2] / moved[:, 2:] - points[:, :2] / points[:, 2:]
    return focal_length * float(np.mean(np.linalg.norm(shifts, axis=1)))
