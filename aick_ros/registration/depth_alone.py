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
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import CELL, FINE_CELL, Surface
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.misalignment import Correction, Displacement, Misalignment
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.refinement.residuals import (
    NormalEquations, Residuals, gradient_noise, point_to_plane)
from aick_ros.registration.result import Evidence, Registration, failed
from aick_ros.registration.status import Status
from aick_ros.settings import Settings

_MOST_STEPS = 12  # chosen: planes are associated anew in each
_SMALLEST_STEP = 1e-4  # m and rad; chosen: a smaller step ends the iteration
_FEWEST_POINTS = 300  # chosen: with fewer the depth image has too many holes
_MIN_OVERLAP = 0.5  # chosen on rendered rooms: share of the points that must lie on a plane
_LARGEST_RESIDUAL = 4.0  # chosen: in standard deviations of the noise, of a point on its plane
_CACHED_FRAMES = 4  # derived: the frame, the shape, the last frame, and one in reserve
_SMALLEST_FACTOR = 0.01  # chosen: floor of the variance, as a ratio to that by the sensor's noise


class DepthAlone:
    """
    Registers depth images to each other, from an expected pose.

    :param noise: of the camera; the bias between keypoints and depth is an error of such a pose.
    :param misalignment: of the camera, by which depth is corrected.
    """

    def __init__(self, settings: Settings, noise: MeasuredNoise | None = None,
                 misalignment: MisalignmentEstimate | None = None) -> None:
        self._settings = settings
        self._noise = noise or MeasuredNoise()
        self._misalignment = misalignment or MisalignmentEstimate()
        self._surfaces = LastResults(self._new_surfaces, _CACHED_FRAMES)

    def register(self, source: PreparedFrame, target: PreparedFrame,
                 expected: PoseWithCovariance, unobserved: np.ndarray) -> Registration:
        """
        Return the pose of the source in the target by depth and by the motion expected.

        It fails where too few points of the source lie on surfaces of the target.

        :param expected: ``T_target_source`` by the motion model since the last frame.
        :param unobserved: 6x6, the covariance of the pose if no frame had been registered since
            keypoints were last seen.
        """
        if source.surface is None or target.surface is None:
            return failed(Status.TOO_FEW_KEYPOINTS, '0 points with depth')
        (surface, of_source), (other, of_target) = map(
            self._surfaces, (source.corrected, target.corrected))
        count = len(surface.chosen)
        if count < _FEWEST_POINTS:
            return failed(Status.TOO_FEW_KEYPOINTS, f'{count} points with depth')
        correction = _correction(source, target, self._misalignment.misalignment)
        coarse = _Depth(surface, other, correction, self._settings)
        fine = _Depth(of_source, of_target, correction, self._settings)
        problem = _Problem(fine, expected)
        pose = problem.solve(_Problem(coarse, expected).solve(expected.matrix))
        overlap = coarse.overlap(pose)
        reason = f'by depth alone, {overlap:.0%} of {count} points'
        if overlap < _MIN_OVERLAP:
            return failed(Status.TOO_FEW_MATCHES, reason)
        bias = self._noise.expected(
            _displacement(surface, pose, source.frame.camera.fx)).bias
        return Registration(
            Status.OK, reason, pose, problem.covariance(pose, unobserved) + bias,
            np.empty((0, 2), np.intp), 0, evidence=Evidence.DEPTH_ALONE, overlap=overlap)

    def _new_surfaces(self, frame: RgbdFrame) -> tuple[Surface, Surface]:
        """Return the coarse and the fine surface of a frame."""
        coarse, fine = (Surface.of(frame.depth, frame.camera, self._settings.sensor,
                                   self._settings.refinement.surface_points, cell,
                                   keeps_rough=True) for cell in (CELL, FINE_CELL))
        return coarse, fine


class _Depth:
    """
    A pair of depth images.

    :param correction: of both, by their motion and the misalignment of the camera.
    """

    def __init__(self, source: Surface, target: Surface, correction: Correction,
                 settings: Settings) -> None:
        self._source, self._target, self._correction = source, target, correction
        self._sensor, self._settings = settings.sensor, settings.refinement

    def residuals(self, pose: np.ndarray) -> Residuals:
        """Return the distances of the source's points from planes of the target, whitened."""
        return point_to_plane(self._source, self._target, pose, self._sensor,
                              self._settings.robust_width, self._settings.reach,
                              self._correction)

    def overlap(self, pose: np.ndarray) -> float:
        """Return the share of the source's points that lie on planes of the target."""
        on_planes = np.abs(self.residuals(pose).values) < _LARGEST_RESIDUAL
        return float(np.count_nonzero(on_planes)) / len(self._source.chosen)


class _Problem:
    """The least-squares problem of one pair of depth images."""

    def __init__(self, depth: _Depth, expected: PoseWithCovariance) -> None:
        self._depth, self._expected = depth, expected
        self._prior = np.linalg.inv(expected.covariance)

    def solve(self, pose: np.ndarray) -> np.ndarray:
        """Return the pose at the minimum near a first one, 4x4."""
        for _ in range(_MOST_STEPS):
            equations = NormalEquations.of([self._depth.residuals(pose)])
            deviation = se3.difference(pose, self._expected.matrix)
            step = -np.linalg.solve(equations.information + self._prior,
                                    equations.gradient + self._prior @ deviation)
            pose = se3.perturbed(pose, step)
            if np.abs(step).max() < _SMALLEST_STEP:
                break
        return pose

    def covariance(self, pose: np.ndarray, unobserved: np.ndarray) -> np.ndarray:
        """
        Return the covariance A^-1 B A^-1, 6x6; B has the scatter of the residuals.

        Velocities are wrong by the same error for many frames, so the motion expected from frame
        to frame holds the solution together, but does not make it more certain.
        """
        residuals = self._depth.residuals(pose)
        information = NormalEquations.of([residuals]).information
        noise = gradient_noise([residuals]) + _SMALLEST_FACTOR * information
        prior = np.linalg.inv(unobserved)
        inverse = np.linalg.inv(information + prior)
        covariance: np.ndarray = inverse @ (noise + prior) @ inverse
        return covariance


def _correction(source: PreparedFrame, target: PreparedFrame,
                misalignment: Misalignment) -> Correction:
    """
    Return what corrects two depth images, to the times of their colour images.

    A target whose velocity is not known moves as the source does; without any both are at rest.
    """
    twist = np.zeros(6) if source.twist is None else source.twist
    twists = (twist, twist if target.twist is None else target.twist)
    return Correction(*(
        Displacement.of(misalignment, frame.depth_lag, twist, frame.frame.camera)
        for frame, twist in zip((source, target), twists)))


def _displacement(surface: Surface, pose: np.ndarray, focal_length: float) -> float:
    """Return how far a motion displaces the image of a surface in the mean [px]."""
    points = surface.points.take(surface.chosen, 0).astype(np.float64)
    moved = se3.transform(pose, points)
    moved, points = moved[moved[:, 2] > 0], points[moved[:, 2] > 0]
    if not len(points):
        return 0.0
    shifts = moved[:, :2] / moved[:, 2:] - points[:, :2] / points[:, 2:]
    return focal_length * float(np.mean(np.linalg.norm(shifts, axis=1)))
