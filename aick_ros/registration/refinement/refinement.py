# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Joint refinement of a pose by keypoints and depth images: one robust least-squares problem.

Keypoints constrain the rotation best, depth images the translation. Both enter a Gauss-Newton
iteration on SE(3) with robust weights, each residual in units of its own noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import seconds
from aick_ros.registration.refinement.approach import Approach
from aick_ros.registration.refinement.estimate import Estimate, joint_estimate
from aick_ros.registration.refinement.first_tracks import FirstTracks
from aick_ros.registration.refinement.measured_noise import MeasuredNoise, Noise, NoiseSample
from aick_ros.registration.refinement.misalignment import (
    NO_CORRECTION, NO_MISALIGNMENT, Correction, Misalignment, Prediction)
from aick_ros.registration.refinement.misalignment_equations import (
    MisalignmentSample, MovingPair, misalignment_sample)
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.refinement.position_jitter import PosesByKind
from aick_ros.registration.refinement.residuals import (
    PRIOR, NormalEquations, PlaneResiduals, Residuals, contradict, point_to_plane, reprojection,
    track_depth, track_steps)
from aick_ros.registration.refinement.tracks import FEWEST_TO_CONFIRM, Tracker, Tracks
from aick_ros.registration.result import Measure, Registration, SensorBias
from aick_ros.settings import RefinementSettings, SensorSettings

_COARSE_STEPS = 1  # chosen: iterations with wide robust weights, by the keypoints alone
_COARSE_WIDTH = 3.0  # chosen: times the final robust width
_FIRST_POINTS = 500
"""About how many points of depth all steps but the last have, each standing for several.

Chosen: by these the last step, with all points, begins so near that the results on two excerpts
of real recordings and six rendered ones are as accurate as with all in every step."""

_SMALLEST_STEP = 2e-5  # m and rad; chosen: a smaller step ends the iteration
_FEWEST_TO_IMPROVE = 7  # derived: if 3 of 7 are outliers, the other 4 still determine a pose
_FEW_TRACKED = 0.5  # chosen: below this share keypoints are tracked again from the better pose
_SMALL_ERROR = 0.2
"""Mean displacement of keypoints by the error of a first pose up to which they are not tracked
again, in windows.

Chosen on two excerpts of real recordings: those tracked again from so near are as many, and move
the pose by a tenth of its standard deviation."""

_INLIER_WEIGHT = 0.25  # by definition: the weight of a residual of one robust width
CONTRADICTION = 'the depths of the two frames contradict each other at most keypoints tracked'
"""Why a pose is rejected although keypoints confirm it."""


@dataclass(frozen=True, eq=False)
class Refined:
    """
    A refined pose.

    :param T_target_source: 4x4 [m].
    :param covariance: 6x6, of noise and of the bias expected [m^2, m rad, rad^2].
    :param systematic: 6x6, the part of the covariance that is the bias expected.
    :param tracked: keypoints of the source that the target sees where the pose puts them.
    :param is_contradicted: whether the depths of the two frames differ at most keypoints, by more
        than those of a right pose do.
    :param bias: between keypoints and depth; None where only keypoints are used.
    :param measure: measures what the residuals show of the camera; None where too few keypoints
        are tracked, or only keypoints are used.
    """

    T_target_source: np.ndarray
    covariance: np.ndarray
    systematic: np.ndarray
    tracked: Tracks
    is_contradicted: bool = False
    bias: SensorBias | None = None
    measure: Measure | None = None

    @property
    def is_confirmed(self) -> bool:
        """Support of the pose by enough keypoints, and by their depths."""
        return len(self.tracked) >= FEWEST_TO_CONFIRM and not self.is_contradicted

    def applied_to(self, registration: Registration, reason: str) -> Registration:
        """Return a registration with this pose and what supports it."""
        return replace(
            registration, T_target_source=self.T_target_source, covariance=self.covariance,
            systematic=self.systematic, bias=self.bias, support=len(self.tracked),
            tracks=self.tracked, measure=self.measure, reason=reason)


class Refinement:
    """
    Refines a first pose; see :class:`aick_ros.settings.RefinementSettings`.

    :param noise: of the camera, by which keypoints and depth are weighted.
    :param misalignment: of the camera, by which both are corrected.
    """

    def __init__(self, settings: RefinementSettings, sensor: SensorSettings,
                 noise: MeasuredNoise | None = None,
                 misalignment: MisalignmentEstimate | None = None) -> None:
        self._settings = settings
        self._sensor = sensor
        self._noise = noise or MeasuredNoise()
        self._misalignment = misalignment or MisalignmentEstimate()
        self._tracker = Tracker(settings, sensor)
        self._approach = Approach(self._tracker, settings, sensor)
        self.first_tracks = FirstTracks(self._tracker, settings.max_tracks)
        """The tracks that refinements of the last source began with."""
        self.count = 0
        """Number of problems solved so far."""

    def refine(self, source: PreparedFrame, target: PreparedFrame,
               T_target_source: np.ndarray, predicted: Prediction | None = None,
               tracks: Tracks | None = None) -> Refined:
        """
        Return the pose that explains the images of both frames best.

        :param T_target_source: first pose, 4x4, with an error of at most some ten pixels.
        :param predicted: shows how fast the source moves, with a pose; None: at its own twist.
        :param tracks: from that pose, where they are known; None: they are made.
        """
        refined, is_rough = self.refine_once(source, target, T_target_source, predicted, tracks)
        if is_rough:
            tracks = self._tracker.track(source, target, refined.T_target_source)
            refined = self._solve(source, target, tracks, refined.T_target_source, predicted)
        return refined

    def refine_once(self, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray, predicted: Prediction | None = None,
                    tracks: Tracks | None = None) -> tuple[Refined, bool]:
        """
        Return a refined pose, and whether it is rough: refined again from there it gets better.

        Parameters are as for :meth:`refine`, which does both.
        """
        if tracks is None:
            tracks = self.first_tracks.of(source, target, T_target_source)
        refined = self._solve(source, target, tracks, T_target_source, predicted)
        sought = self._settings.sought(len(source.keypoints))
        return refined, (len(tracks) >= _FEWEST_TO_IMPROVE
                         and len(refined.tracked) < _FEW_TRACKED * sought
                         and not self._is_small(tracks, target, T_target_source,
                                                refined.T_target_source))

    def _is_small(self, tracks: Tracks, target: PreparedFrame, first: np.ndarray,
                  refined: np.ndarray) -> bool:
        """Return whether the error of a first pose, by a refined one, hides no keypoints."""
        before, after = (se3.transform(pose, tracks.points) for pose in (first, refined))
        shifts = target.frame.camera.fx * (
            after[:, :2] / after[:, 2:] - before[:, :2] / before[:, 2:])
        limit = _SMALL_ERROR * self._settings.track_window
        return float(np.hypot(*shifts.T).mean()) < limit

    def refine_near(self, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray, predicted: Prediction | None = None) -> Refined:
        """Return what :meth:`refine` does, of a first pose with an error of two pixels at most."""
        tracks = self._tracker.track(source, target, T_target_source, is_near=True)
        return self.refine(source, target, T_target_source, predicted, tracks)

    def refine_back(self, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray, predicted: Prediction | None = None) -> Refined:
        """
        Return the pose of a source that has no keypoints: those of the target are tracked into it.

        The keypoints tracked are those of the target; parameters as for :meth:`refine`.
        """
        nearer = self._approach.nearer(source, target, T_target_source)
        pose = T_target_source if nearer is None else nearer
        tracks = self._tracker.track_back(source, target, pose, is_near=nearer is not None)
        return self._solve(source, target, tracks, pose, predicted)

    def _solve(self, source: PreparedFrame, target: PreparedFrame, tracks: Tracks,
               pose: np.ndarray, predicted: Prediction | None) -> Refined:
        self.count += 1
        problem = _Problem(source, target, tracks, self._settings, self._sensor, self._noise)
        misalignment = self._misalignment.misalignment
        problem.correct(misalignment, source.twist, pose)
        for i in range(self._settings.iterations - 1):
            pose, step = problem.step(pose, coarse=i < _COARSE_STEPS)
            if i == _COARSE_STEPS and predicted is not None:
                problem.correct(misalignment, predicted.twist_with(pose), pose)
            if i > _COARSE_STEPS and np.abs(step).max() < _SMALLEST_STEP:
                break
        return problem.finish(pose)


class _Problem:
    """The least-squares problem of one pair of frames."""

    def __init__(self, source: PreparedFrame, target: PreparedFrame, tracks: Tracks,
                 settings: RefinementSettings, sensor: SensorSettings,
                 noise: MeasuredNoise) -> None:
        self._source, self._target = source, target
        self._seen = self._tracks = tracks
        self._displacement = tracks.displacement(target.frame.camera.fx)
        is_joint = source.surface is not None and target.surface is not None
        self._choice = noise.points
        self._points = None if source.surface is None else noise.points.of(source.surface)
        self._noise = noise.expected(self._displacement) if is_joint else Noise()
        self._sparseness = 1 if self._points is None else max(
            len(self._points.chosen) // _FIRST_POINTS, 1)
        self._misalignment, self._twists = NO_MISALIGNMENT, np.zeros((2, 6))
        self._correction = NO_CORRECTION
        self._depth_rate = depth_rate(source, target)
        self._ray_sigma = settings.track_sigma / target.frame.camera.fx
        self._settings = settings
        self._sensor = sensor

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
        self._tracks = self._correction.tracks(self._seen, self._source, self._sensor, pose)

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
        inliers = by_keypoints[0].weights[:len(self._tracks)] > _INLIER_WEIGHT
        bias, measure = None, None
        if by_depth:
            bias = SensorBias(depth.error - keypoints.error,
                              keypoints.covariance + depth.covariance, gain,
                              keypoints.expected_covariance + depth.expected_covariance)
            if len(self._tracks) >= FEWEST_TO_CONFIRM:
                measure = Measure(
                    partial(self._noise_shown_by, bias, pose, keypoints, depth, by_depth[0]),
                    partial(self._misalignment_shown_by, by_keypoints[0], by_depth[0], pose))
        return Refined(joint, covariance, noise.bias, self._seen[inliers],
                       contradict(by_keypoints[1]), bias, measure=measure)

    def _misalignment_shown_by(self, keypoints: Residuals, depth: PlaneResiduals,
                               pose: np.ndarray) -> MisalignmentSample | None:
        if self._points is None:
            return None
        pair = MovingPair(self._source, self._target, self._points, pose, self._twists)
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
                           None if target is None else self._choice.shown_by(residuals, target))

    def _of_keypoints(self, pose: np.ndarray) -> list[Residuals]:
        width = self._settings.robust_width
        return [reprojection(self._tracks, pose, self._ray_sigma, width),
                track_depth(self._tracks, pose, self._sensor, width)]

    def _of_depth(self, pose: np.ndarray, every: int = 1) -> list[PlaneResiduals]:
        source, target = self._points, self._target.surface
        if source is None or target is None:
            return []
        # the depth images may be more or less time apart than the colour images
        return [point_to_plane(
            source, target, pose, self._sensor, self._settings.robust_width, self._settings.reach,
            self._correction, self._depth_rate, every)]


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
