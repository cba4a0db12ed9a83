# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""AICK followed by a refinement whose tracks must confirm the pose."""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.features.detector import Detector
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.stamps import seconds
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.aick.fit_covariance import fit_covariance
from aick_ros.registration.apparent_acceleration import ApparentAcceleration
from aick_ros.registration.dynamic_objects import DynamicObjectCheck
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.prediction import Prediction
from aick_ros.registration.refinement.measured_noise import MeasuredNoise
from aick_ros.registration.refinement.refined import CONTRADICTION, Refined
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.repeating_scene import RepeatingSceneCheck
from aick_ros.registration.result import Registration, failed
from aick_ros.registration.sensor_agreement import SensorAgreement
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.registration.tracked_keypoints import SHARE_TRACKED
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM
from aick_ros.registration.unexpected_motion import NEAR_POSE, is_same
from aick_ros.settings import Settings

_SLOW_SCHEDULE = 0.93, 60
"""alpha and iterations, chosen: descriptors keep their weight for longer than in the paper."""

_CACHED_FRAMES = 8  # chosen: a lost frame is tried against several earlier ones
_FEWEST_UNVERIFIED = 60  # chosen: matches that a pose needs if no tracks confirm it
_UNVERIFIED_COVARIANCE_FACTOR = 100.0  # chosen: AICK's covariance has no systematic errors
_SHARE_GUESSED = 0.5  # chosen: share of the keypoints that must be tracked to confirm a guess


class VerifiedAick:
    """
    Registers frames by AICK and refines the pose; tracked keypoints must confirm it.

    Where AICK finds no pose, or none that is confirmed, it runs once more with all keypoints and a
    slower schedule, unless keypoints tracked from a rough pose confirm that. Where that fails too,
    the pose expected, at constant velocity or by other sensors, is refined.

    :param aick: with the schedule of the settings.
    :param refinement: of the frames of one camera.
    :param noise: of that camera.
    :param times: adds up the time of each stage.
    :param detector: used instead of the one that ``features.detector`` names.
    """

    def __init__(self, settings: Settings, aick: Aick, refinement: Refinement,
                 noise: MeasuredNoise, times: StageTimes,
                 detector: Detector | None = None) -> None:
        self._aick = aick
        self._times = times
        self._settings = settings.refinement
        self._refinement = refinement
        agreement = SensorAgreement(noise)
        self._acceleration = ApparentAcceleration(settings.odometry)
        self._repeating_scene = RepeatingSceneCheck(
            refinement, settings.odometry, agreement, self._acceleration)
        self._dynamic_objects = DynamicObjectCheck(
            refinement, settings, agreement, self._acceleration)
        alpha, iterations = _SLOW_SCHEDULE
        self._slow_aick = Aick(dataclasses.replace(settings.aick, alpha=alpha,
                                                   iterations=iterations))
        unlimited = dataclasses.replace(settings.features, max_keypoints=0)
        self._all_keypoints = LastResults(
            KeypointExtractor(
                unlimited, settings.sensor.without_mask, detector=detector).extract,
            _CACHED_FRAMES)  # of frames that are masked

    def register(self, source: PreparedFrame, target: PreparedFrame,
                 expected: ExpectedPose | None, tracked: np.ndarray | None = None) -> Registration:
        """
        Return the pose of the source in the target.

        :param expected: None: nothing is known of the motion.
        :param tracked: a rough pose by tracking, 4x4. Where AICK finds about the same the
            refinement begins there; where it finds none in one attempt, enough keypoints of the
            source itself that are tracked from there confirm it. None: there is none.
        """
        predicted = None if expected is None else expected.prediction(source.twist)
        found = self.recognize(source, target, predicted, tracked)
        if not found.status.ok:
            with self._times.stage('registration'):
                slow = self._align_slowly(source.frame, target.frame)
            found = self._refine(source, target, slow, predicted)
        if expected is None:
            at_rest = ExpectedPose(np.eye(4), abs(seconds(target.stamp, source.stamp)))
            self._acceleration.note(source.stamp, found, at_rest)
            return found
        if not found.status.ok:
            return self._refine_guess(source, target, expected.T_target_source, found)
        with self._times.stage('refinement'):
            checked = self._repeating_scene.check(found, source, target, expected)
            if checked is found:
                checked = self._dynamic_objects.check(found, source, target, expected)
        self._acceleration.note(source.stamp, checked, expected)
        if checked.status.ok:
            self._refinement.remember_objects(
                source, target, checked.T_target_source, checked.tracks, checked.fit)
        return checked

    def recognize(self, source: PreparedFrame, target: PreparedFrame,
                  predicted: Prediction | None = None,
                  tracked: np.ndarray | None = None) -> Registration:
        """
        Return the pose of the source in the target by AICK in one attempt, without a guess.

        :param predicted: used for the velocity of the source, not for its pose.
        :param tracked: as for :meth:`register`; the pose may be that one, refined.
        """
        with self._times.stage('registration'):
            aligned = self._aick.align(source.keypoints, target.keypoints)
        if (tracked is None or source.grey.shape != target.grey.shape
                or aligned.status.ok and not is_same(
                    aligned.T_target_source, tracked, NEAR_POSE)):
            return self._refine(source, target, aligned, predicted)
        with self._times.stage('refinement'):
            refined = self._refinement.refine_near(source, target, tracked, predicted)
        if aligned.status.ok:
            # the pose of AICK may be the one of the two that is near enough
            return (_confirmed(source, target, aligned, refined) if refined.is_confirmed
                    else self._refine(source, target, aligned, predicted))
        # as many as confirm a frame by tracking alone: the pose expected led to this one, too
        if len(refined.tracked) < SHARE_TRACKED * self._settings.sought(len(source.keypoints)):
            return aligned
        return _confirmed(source, target, dataclasses.replace(
            aligned, status=Status.OK, reason='by tracking'), refined)

    def recognize_partly(self, source: PreparedFrame, target: PreparedFrame,
                         aligned: Registration) -> Registration:
        """
        Return what :meth:`recognize` does, in two parts where keypoints are tracked twice.

        :param aligned: the attempt of AICK, or what the first part has returned: a rough one.
        """
        if not aligned.status.ok or source.grey.shape != target.grey.shape:
            return self._refine(source, target, aligned)
        with self._times.stage('refinement'):
            refined, is_rough = self._refinement.refine_once(
                source, target, aligned.T_target_source)
        if is_rough and not aligned.is_rough:
            return dataclasses.replace(
                aligned, T_target_source=refined.T_target_source, is_rough=True)
        return _confirmed(source, target, dataclasses.replace(aligned, is_rough=False), refined)

    def _align_slowly(self, source: RgbdFrame, target: RgbdFrame) -> Registration:
        """Return the registration by AICK with all keypoints and the slow schedule."""
        found = self._slow_aick.register(self._all_keypoints(source), self._all_keypoints(target))
        # its matches are rows of other keypoint frames than those of the caller
        return dataclasses.replace(found, matches=found.matches[:0])

    def _refine(self, source: PreparedFrame, target: PreparedFrame,
                registration: Registration,
                predicted: Prediction | None = None) -> Registration:
        """Return the refined registration; failed if it was, or if tracks do not confirm it."""
        if not registration.status.ok:
            return registration
        if source.grey.shape != target.grey.shape:  # the camera has changed its resolution
            return _unverified(registration, source, target, 0)
        with self._times.stage('refinement'):
            refined = self._refinement.refine(
                source, target, registration.T_target_source, predicted)
        return _confirmed(source, target, registration, refined)

    def _refine_guess(self, source: PreparedFrame, target: PreparedFrame, guess: np.ndarray,
                      failure: Registration) -> Registration:
        """Return the refinement of a guessed pose; the failure if tracks do not confirm it."""
        registration = self._refine(source, target, dataclasses.replace(
            failure, status=Status.OK, T_target_source=guess, reason='by the pose expected'))
        sought = self._settings.sought(len(source.keypoints))
        fewest = max(FEWEST_TO_CONFIRM, _SHARE_GUESSED * sought)
        return registration if registration.support >= fewest else failure


def _unverified(registration: Registration, source: PreparedFrame, target: PreparedFrame,
                tracked: int) -> Registration:
    """Return a registration that tracks do not confirm: doubtful, failed if of few matches."""
    reason = f'{registration.reason}, {tracked} keypoints tracked'
    if registration.support < _FEWEST_UNVERIFIED:
        return failed(Status.TOO_FEW_MATCHES, reason, registration.iterations)
    covariance = registration.covariance
    if len(registration.matches):
        covariance = fit_covariance(registration.T_target_source, source.keypoints,
                                    target.keypoints, registration.matches)
    return dataclasses.replace(registration, reason=reason,
                               covariance=_UNVERIFIED_COVARIANCE_FACTOR * covariance)


def _confirmed(source: PreparedFrame, target: PreparedFrame, registration: Registration,
               refined: Refined) -> Registration:
    """Return a registration with a refined pose; failed if tracks do not confirm that."""
    if len(refined.tracked) < FEWEST_TO_CONFIRM:
        return _unverified(registration, source, target, len(refined.tracked))
    if refined.is_contradicted:
        return failed(Status.TOO_FEW_MATCHES, CONTRADICTION, registration.iterations)
    return refined.applied_to(
        registration, f'{registration.reason}, {len(refined.tracked)} keypoints tracked')
