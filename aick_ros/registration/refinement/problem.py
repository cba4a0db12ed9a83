# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The least-squares problem of one pair of frames."""

from __future__ import annotations

from functools import partial

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.median import median
from aick_ros.geometry.stamps import seconds
from aick_ros.registration.found_objects import Places
from aick_ros.registration.refinement.estimate import Estimate, joint_estimate
from aick_ros.registration.refinement.measured_noise import MeasuredNoise, Noise
from aick_ros.registration.refinement.misalignment import (
    NO_CORRECTION, NO_MISALIGNMENT, Correction, Misalignment)
from aick_ros.registration.refinement.misalignment_equations import MovingPair, misalignment_sample
from aick_ros.registration.refinement.moving_objects import LEAST_SHARE, MovingObjects
from aick_ros.registration.refinement.refined import Refined
from aick_ros.registration.refinement.residuals import (
    PRIOR, NormalEquations, PlaneResiduals, Residuals, contradict, point_to_plane, reprojection,
    squared_errors, track_depth, track_steps)
from aick_ros.registration.refinement.shutters import Shutters, Solution
from aick_ros.registration.result import Fit, SensorBias
from aick_ros.registration.samples import Measure, MisalignmentSample, NoiseSample, PosesByKind
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks
from aick_ros.settings import RefinementSettings, SensorSettings

_COARSE_WIDTH = 3.0  # chosen: times the final robust width
_FIRST_POINTS = 500
"""About how many points of depth all steps but the last have, each standing for several.

Chosen: by these the last step, with all points, begins so near that the results on two excerpts
of real recordings and six rendered ones are as accurate as with all in every step."""

_INLIER_WEIGHT = 0.25  # by definition: the weight of a residual of one robust width


class Problem:
    """The least-squares problem of one pair of frames."""

    def __init__(self, source: PreparedFrame, target: PreparedFrame, tracks: Tracks,
                 settings: RefinementSettings, sensor: SensorSettings,
                 noise: MeasuredNoise) -> None:
        self._source, self._target = source, target
        self._seen = self._all_tracks = self._tracks = tracks
        self._displacement = tracks.displacement(target.frame.camera.fx)
        is_joint = source.surface is not None and target.surface is not None
        self._choice = noise.points
        points = None if source.surface is None else noise.points.of(source.surface)
        self._noise = noise.expected(self._displacement) if is_joint else Noise()
        self._sparseness = 1 if points is None else max(len(points.chosen) // _FIRST_POINTS, 1)
        self._misalignment, self._twists = NO_MISALIGNMENT, np.zeros((2, 6))
        self._correction = NO_CORRECTION
        self._depth_rate = depth_rate(source, target)
        self._ray_sigma = settings.track_sigma / target.frame.camera.fx
        self._settings = settings
        self._sensor = sensor
        self._objects = MovingObjects(
            len(tracks), points, source.frame.camera, self._ray_sigma, settings, sensor)

    def correct(self, misalignment: Misalignment, twist: np.ndarray | None,
                pose: np.ndarray) -> None:
        """
        Correct what both frames see by the misalignment of the camera.

        :param twist: body velocity of the source [m/s, rad/s]; where that of one frame is not
            known, both count as at rest.
        :param pose: ``T_target_source``, roughly.
        """
        if twist is not None and self._target.twist is not None:
            self._twists = np.array([twist, self._target.twist])
        self._misalignment = misalignment
        lag = mean_depth_lag(self._source, self._target)
        if not misalignment.values.any() and (not lag or not self._twists.any()):
            return
        self._correction = Correction.of(
            misalignment, (lag, lag), self._twists,
            (self._source.frame.camera, self._target.frame.camera))
        self._all_tracks = self._correction.tracks(
            self._seen, self._source, self._sensor, pose)
        self._tracks = self._all_tracks[self._objects.kept]

    def begin_without(self, known: Places | None, others: Tracks | None, pose: np.ndarray) -> None:
        """
        Leave out objects that move by themselves, if they are known.

        :param known: of the target. Their tracks are kept where others are given.
        :param others: tracks on objects that the problem does not have.
        :param pose: ``T_target_source``, roughly.
        """
        if known is not None:
            self._objects.recall(known, self._all_tracks, pose)
        if others is not None:
            self._objects.leave_out(others, self._all_tracks, pose)
        elif known is not None:
            self._objects.leave_out_known(self._all_tracks, pose)
            self._tracks = self._all_tracks[self._objects.kept]

    def leave_out_objects(self, pose: np.ndarray, least_share: float = LEAST_SHARE) -> bool:
        """
        Leave out the objects that move by themselves.

        :param pose: ``T_target_source`` of the scene.
        :param least_share: of the tracks that must be on objects.
        :returns: whether they are others than before.
        """
        are_others = self._objects.search(self._all_tracks, pose, least_share)
        if are_others:
            self._tracks = self._all_tracks[self._objects.kept]
        return are_others

    def step(self, pose: np.ndarray, coarse: bool) -> tuple[np.ndarray, np.ndarray]:
        """Return the pose after a Gauss-Newton step and the step; coarse: by keypoints, if any."""
        by_depth = () if coarse and len(self._tracks) else self._of_depth(pose, self._sparseness)
        wider = _COARSE_WIDTH if coarse else 1.0
        weight = 1 / self._noise.keypoints / self._sparseness  # as depth has fewer points
        return track_steps(self._tracks, pose, self._ray_sigma, self._sensor,
                           self._settings.robust_width, [wider], weight,
                           NormalEquations.of(by_depth, PRIOR))

    def finish(self, pose: np.ndarray) -> Refined:
        """
        Return the pose after a last step, with its covariance and the bias expected.

        In that step depth has its part of the bias, and keypoints their jitter.
        """
        noise = self._noise
        by_keypoints, by_depth = self._of_keypoints(pose), self._of_depth(pose)
        keypoints = Estimate.of(by_keypoints, 1 / noise.keypoints, noise.keypoint_jitter,
                                noise.keypoint_scatter.shape)
        depth = Estimate.of(by_depth, 1.0, noise.depth_bias, noise.depth_scatter.shape)
        joint, covariance, gain = joint_estimate(keypoints, depth, pose, noise.bias)
        shutters = Shutters(Solution(joint, self._tracks, by_keypoints[0], by_depth, gain),
                            self._source, self._target)
        if self._twists.any():
            covariance = covariance + shutters.errors(
                self._misalignment, mean_depth_lag(self._source, self._target))
        inliers = by_keypoints[0].weights[:len(self._tracks)] > _INLIER_WEIGHT
        bias, measure = None, None
        if by_depth:
            bias = SensorBias(depth.error - keypoints.error,
                              keypoints.covariance + depth.covariance, gain,
                              keypoints.expected_covariance + depth.expected_covariance)
            if len(self._tracks) >= FEWEST_TO_CONFIRM and bias.is_shown:
                measure = Measure(
                    partial(self._noise_shown_by, bias, pose, keypoints, depth, by_depth[0]),
                    partial(self._misalignment_shown_by, by_keypoints[0], by_depth[0], pose))
        agreeing = np.flatnonzero(self._objects.kept)[inliers]
        return Refined(joint, covariance, noise.bias, self._seen[agreeing],
                       contradict(by_keypoints[1]), bias, measure,
                       self._fit(by_keypoints[0], inliers, agreeing, joint),
                       shutters.by_readout(self._twists))

    def _fit(self, errors: Residuals, inliers: np.ndarray, agreeing: np.ndarray,
             pose: np.ndarray) -> Fit:
        """Return the fit of the tracks that agree, by the reprojection errors of all."""
        return Fit(squared_errors(errors)[inliers], self._objects.scene_share,
                   self._objects.known_share(agreeing),
                   self._objects.found(self._all_tracks, agreeing, pose,
                                       max(self._source.stamp, self._target.stamp)))

    def _misalignment_shown_by(self, keypoints: Residuals, depth: PlaneResiduals,
                               pose: np.ndarray) -> MisalignmentSample | None:
        points = self._objects.surface
        if points is None:
            return None
        pair = MovingPair(self._source, self._target, points, pose, self._twists)
        return misalignment_sample(keypoints, depth, self._tracks, pair,
                                   1 / self._noise.keypoints, self._misalignment)

    def _noise_shown_by(self, bias: SensorBias, pose: np.ndarray, keypoints: Estimate,
                        depth: Estimate, residuals: PlaneResiduals) -> NoiseSample:
        """Return the noise by two estimates, made at a pose, with the bias between them."""
        poses = PosesByKind((self._source.stamp, self._target.stamp),
                            se3.perturbed(pose, -keypoints.error),
                            se3.perturbed(pose, -depth.error),
                            float(np.trace(keypoints.covariance[:3, :3])) / 3)
        target = self._target.surface
        return NoiseSample(self._displacement, keypoints.design_effect / depth.design_effect,
                           bias.normalised, bias.squares, poses,
                           (keypoints.shown, depth.shown),
                           None if target is None else self._choice.shown_by(residuals, target),
                           _median_length(residuals))

    def _of_keypoints(self, pose: np.ndarray) -> list[Residuals]:
        width = self._settings.robust_width
        return [reprojection(self._tracks, pose, self._ray_sigma, width),
                track_depth(self._tracks, pose, self._sensor, width)]

    def _of_depth(self, pose: np.ndarray, every: int = 1) -> list[PlaneResiduals]:
        source, target = self._objects.surface, self._target.surface
        if source is None or target is None:
            return []
        # the depth images may be more or less time apart than the colour images
        return [point_to_plane(
            source, target, pose, self._sensor, self._settings.robust_width, self._settings.reach,
            self._correction, self._depth_rate, every)]


def _median_length(residuals: Residuals) -> float | None:
    """Return the median length of residuals; None without any."""
    return median(np.abs(residuals.values)) if len(residuals.values) else None


def mean_depth_lag(source: PreparedFrame, target: PreparedFrame) -> float:
    """
    Return the mean time from the colour to the depth images of two frames [s].

    The rate of :func:`depth_rate` has what the two times differ by.
    """
    return 0.5 * (source.depth_lag + target.depth_lag)


def depth_rate(source: PreparedFrame, target: PreparedFrame) -> float:
    """Return the time between the depth images, as a ratio to that between the colour images."""
    interval = seconds(target.stamp, source.stamp)
    if interval == 0.0:
        return 1.0
    rate = 1.0 + (source.depth_lag - target.depth_lag) / interval
    return rate if 0.0 < rate < 2.0 else 1.0
