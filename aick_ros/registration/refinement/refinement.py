# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Joint refinement of a pose by keypoints and depth images: one robust least-squares problem.

Keypoints constrain the rotation best, depth images the translation. Both enter a Gauss-Newton
iteration on SE(3) with robust weights, each residual in units of its own noise.
"""

from __future__ import annotations

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import of_inverse
from aick_ros.registration.prediction import Prediction
from aick_ros.registration.refinement.approach import Approach
from aick_ros.registration.refinement.first_tracks import FirstTracks
from aick_ros.registration.refinement.intruders import on_intruders
from aick_ros.registration.refinement.known_objects import KnownObjects
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.misalignment_estimate import MisalignmentEstimate
from aick_ros.registration.refinement.moving_objects import LEAST_SHARE
from aick_ros.registration.refinement.problem import Problem
from aick_ros.registration.refinement.refined import Refined
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.registration.result import Fit
from aick_ros.registration.tracks import Tracks
from aick_ros.settings import RefinementSettings, SensorSettings

_COARSE_STEPS = 1  # chosen: iterations with wide robust weights, by the keypoints alone
_ROUNDS = 3  # chosen: of leaving out objects that move by themselves, each from a better pose
_SMALLEST_STEP = 2e-5  # m and rad; chosen: a smaller step ends the iteration
_SMALL_SHARE = 0.05  # chosen: of the tracks, on objects that are sought if depth shows them
_FEWEST_TO_IMPROVE = 7  # derived: if 3 of 7 are outliers, the other 4 still determine a pose
_FEW_TRACKED = 0.5  # chosen: below this share keypoints are tracked again from the better pose
_SMALL_ERROR = 0.2
"""Mean displacement of keypoints by the error of a first pose up to which they are not tracked
again, in windows.

Chosen on two excerpts of real recordings: those tracked again from so near are as many, and move
the pose by a tenth of its standard deviation."""


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
        self._known_objects = KnownObjects()
        self.count = 0
        """Number of problems solved so far."""

    def refine(self, source: PreparedFrame, target: PreparedFrame,
               T_target_source: np.ndarray, predicted: Prediction | None = None,
               tracks: Tracks | None = None, moving: Tracks | None = None) -> Refined:
        """
        Return the pose that explains the images of both frames best.

        :param T_target_source: first pose, 4x4, with an error of at most some ten pixels.
        :param predicted: shows how fast the source moves, with a pose; None: at its own twist.
        :param tracks: from that pose, where they are known; None: they are made.
        :param moving: others, on what moves by itself: depth near them is not used.
        """
        refined, is_rough = self.refine_once(source, target, T_target_source, predicted, tracks,
                                             moving)
        if is_rough:
            tracks = self._tracker.track(source, target, refined.T_target_source)
            refined = self._solve(source, target, tracks, refined.T_target_source, predicted,
                                  moving)
        return refined

    def refine_once(self, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray, predicted: Prediction | None = None,
                    tracks: Tracks | None = None,
                    moving: Tracks | None = None) -> tuple[Refined, bool]:
        """
        Return a refined pose, and whether it is rough: refined again from there it gets better.

        Parameters are as for :meth:`refine`, which does both.
        """
        if tracks is None:
            tracks = self.first_tracks.of(source, target, T_target_source)
        refined = self._solve(source, target, tracks, T_target_source, predicted, moving)
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

    def without_small_objects(self, source: PreparedFrame, target: PreparedFrame,
                              T_target_source: np.ndarray) -> Refined:
        """Return what :meth:`refine` does, without objects that few keypoints are on, too."""
        tracks = self._tracker.track(source, target, T_target_source)
        return self._solve(source, target, tracks, T_target_source, None,
                           least_share=_SMALL_SHARE)

    def without_known_objects(self, source: PreparedFrame, target: PreparedFrame,
                              T_target_source: np.ndarray) -> Refined | None:
        """
        Return a refined pose by tracks on no object that has moved before, whatever it shows.

        Where too few tracks are beside such objects, all have a part, and the pose may be that of
        an object: its fit has a ``known_share`` then.

        :param T_target_source: first pose, 4x4.
        :returns: None where nothing known is in the view.
        """
        if self._known_objects.of(target.stamp, source.stamp) is None:
            return None
        tracks = self.first_tracks.of(source, target, T_target_source)
        refined = self._solve(source, target, tracks, T_target_source, None, least_share=None)
        return None if refined.fit is None or refined.fit.objects is None else refined

    def remember_objects(self, source: PreparedFrame, target: PreparedFrame,
                         T_target_source: np.ndarray, tracks: Tracks | None,
                         fit: Fit | None) -> None:
        """
        Remember what moves by itself, or has moved in, by a registration that is accepted.

        :param tracks: that agree with the pose.
        """
        if fit is None:
            return
        self._known_objects.note(source.stamp, target.stamp, fit.objects)
        if source.stamp > target.stamp:
            intruders = on_intruders(source, target, T_target_source, self._sensor)
            if intruders.any():
                scene = np.empty((0, 3)) if tracks is None else tracks.points
                self._known_objects.note_intruders(
                    source.stamp, scene, source.keypoints.positions[intruders])

    def refine_back(self, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray, predicted: Prediction | None = None) -> Refined:
        """
        Return the pose of a source that has no keypoints: those of the target are tracked into it.

        The keypoints tracked are those of the target; parameters as for :meth:`refine`.
        """
        pose, is_near = self._approached(source, target, T_target_source)
        tracks = self._tracker.track_back(source, target, pose, is_near=is_near)
        return self._solve(source, target, tracks, pose, predicted)

    def refine_without_depth(self, source: PreparedFrame, target: PreparedFrame,
                             T_target_source: np.ndarray) -> Refined:
        """
        Return the pose of a source that needs neither keypoints nor depth.

        The keypoints of the target are tracked into it, with their depth in the target.

        :param T_target_source: first pose, 4x4, with an error of at most some ten pixels.
        :returns: ``tracked`` are keypoints of the target that the source sees.
        """
        first, is_near = self._approached(source, target, T_target_source)
        pose = se3.inverse(first)
        tracks = self._tracker.track(target, source, pose, is_near=is_near)
        back = self._solve(target, source, tracks, pose, None)
        bias = np.zeros((6, 6))
        if target.surface is not None:  # poses of frames with depth follow that, too
            bias = self._noise.expected(
                back.tracked.displacement(source.frame.camera.fx)).bias
        found = back.pose.with_covariance(back.covariance - back.systematic).inverse()
        return replaced(back, T_target_source=found.matrix, covariance=found.covariance + bias,
                        systematic=bias,
                        by_readout=of_inverse(back.T_target_source) @ back.by_readout)

    def _approached(self, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray) -> tuple[np.ndarray, bool]:
        """Return a pose brought near by a few keypoints of the target, and whether they do."""
        nearer = self._approach.nearer(source, target, T_target_source)
        return (T_target_source, False) if nearer is None else (nearer, True)

    def _solve(self, source: PreparedFrame, target: PreparedFrame, tracks: Tracks,
               pose: np.ndarray, predicted: Prediction | None,
               moving: Tracks | None = None,
               least_share: float | None = LEAST_SHARE) -> Refined:
        self.count += 1
        problem = Problem(source, target, tracks, self._settings, self._sensor, self._noise)
        misalignment = self._misalignment.misalignment
        problem.correct(misalignment, source.twist, pose)
        problem.begin_without(self._known_objects.of(target.stamp, source.stamp), moving, pose)
        for i in range(self._settings.iterations - 1):
            pose, step = problem.step(pose, coarse=i < _COARSE_STEPS)
            if i == _COARSE_STEPS and predicted is not None:
                problem.correct(misalignment, predicted.twist_with(pose), pose)
            if i > _COARSE_STEPS and np.abs(step).max() < _SMALLEST_STEP:
                break
        if least_share is not None:
            pose = self._without_objects(problem, pose, least_share)
        return problem.finish(pose)

    def _without_objects(self, problem: Problem, pose: np.ndarray,
                         least_share: float) -> np.ndarray:
        """Return the pose by all but the objects that move by themselves, 4x4."""
        for _ in range(_ROUNDS):
            if not problem.leave_out_objects(pose, least_share):
                break
            for _ in range(self._settings.iterations):
                pose, step = problem.step(pose, coarse=False)
                if np.abs(step).max() < _SMALLEST_STEP:
                    break
        return pose
