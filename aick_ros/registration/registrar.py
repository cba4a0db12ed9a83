# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A registration from two frames to one pose: keypoints, AICK, refinement, covariance."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass, field

import numpy as np

from aick_ros.features.detector import Detector
from aick_ros.features.vocabulary import vocabulary_of
from aick_ros.frames.camera_clock import CameraClock
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.aick.fit_covariance import fit_covariance
from aick_ros.registration.dynamic_objects import DynamicObjectCheck
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.result import Registration, failed
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.registration.systematic_error import Uncertainty
from aick_ros.settings import Settings

_PATIENT = {'alpha': 0.93, 'iterations': 60}  # appearance leads for longer than in the paper
_REMEMBERED = 8  # frames of which all keypoints are kept
_FEWEST_TRACKS = 12  # fewer do not check a pose
_FEWEST_UNCHECKED = 60  # matches of a pose that is believed without
_DOUBT = 100.0  # times the covariance of AICK's fit, which knows no systematic error
_SHARE_OF_TRACKS = 0.5  # of the keypoints must be found for a guess to be believed


@dataclass(frozen=True)
class Learned:
    """What was learnt of a camera, whatever the settings: its beats and its calibration."""

    colour_clock: CameraClock = field(default_factory=CameraClock)
    depth_clock: CameraClock = field(default_factory=CameraClock)
    uncertainty: Uncertainty = field(default_factory=Uncertainty)


class Registrar:
    """
    Registers the views of one camera.

    AICK needs no initial guess. Where it finds nothing, or what it finds is not what the images
    show, it is given all keypoints and a slower schedule; where that fails too a guess
    is tried. Both must be confirmed by the images.

    :param times: told how long each stage takes.
    :param learned: of the camera, by registrars with other settings; it is added to.
    :param detector: used instead of the one that ``features.detector`` names.
    """

    def __init__(self, settings: Settings = Settings(),
                 times: StageTimes | None = None, learned: Learned | None = None,
                 detector: Detector | None = None) -> None:
        self._settings = settings
        self._times = times or StageTimes()
        self._extractor = KeypointExtractor(settings.features, settings.sensor,
                                            vocabulary_of(settings), settings.aick.word_radius,
                                            detector)
        self._aick = Aick(settings.aick)
        self._refinement = None
        if settings.refinement.mode != 'none':
            self._refinement = Refinement(settings.refinement, settings.sensor)
            self._second_opinion = DynamicObjectCheck(self._refinement, settings.sensor)
            self._patient_aick = Aick(dataclasses.replace(settings.aick, **_PATIENT))
            patient = KeypointExtractor(
                dataclasses.replace(settings.features, max_keypoints=0), settings.sensor,
                detector=detector)
            # a lost frame is tried against several others, one after another
            self._all_keypoints = functools.lru_cache(_REMEMBERED)(patient.extract)
        self._learned = learned or Learned()

    def prepare(self, frame: RgbdFrame) -> PreparedFrame:
        """Return what registrations need of a frame; frames come in the order of their stamps."""
        with self._times.stage('features'):
            keypoints, grey = self._extractor.extract(frame), frame.grey
        surface = None
        if self._settings.refinement.mode == 'joint':
            with self._times.stage('surface'):
                surface = Surface.of(frame.depth, frame.camera, self._settings.sensor,
                                     self._settings.refinement.surface_points)
        return PreparedFrame(frame, keypoints, grey, surface, self._depth_lag(frame),
                    self._learned.colour_clock.jitter)

    def register(self, source: PreparedFrame, target: PreparedFrame,
                 expected: np.ndarray | None = None, elapsed: float = np.inf) -> Registration:
        """
        Return where the source was, seen from the target.

        :param expected: ``T_target_source`` at constant velocity; None where none is known.
        :param elapsed: how long ago that velocity was seen [s].
        """
        with self._times.stage('registration'):
            if self._refinement is None:
                return self._aick.register(source.keypoints, target.keypoints)
            found = self._aick.align(source.keypoints, target.keypoints)
        found = self._refined(source, target, found)
        if not found.status.ok:
            with self._times.stage('registration'):
                patient = self._patiently(source.frame, target.frame)
            found = self._refined(source, target, patient)
        if not found.status.ok and expected is not None:
            found = self._confirmed(source, target, expected, found)
        elif found.status.ok and expected is not None:
            with self._times.stage('refinement'):
                found = self._second_opinion.check(found, source, target, expected, elapsed)
        return self._learned.uncertainty.complete(found, source, target, expected, elapsed)

    def place(self, source: PreparedFrame, target: PreparedFrame, expected: np.ndarray | None = None,
              elapsed: float = np.inf) -> Registration:
        """
        Return where the source was, seen from the target, by the keypoints of the target.

        They are found in the source: that is the better way where they are known better than
        those of one frame. The tracks of what is returned are those of the target.

        :param expected: as in :meth:`register`; ``elapsed`` likewise.
        """
        if expected is not None:
            expected = se3.inverse(expected)
        found = self.register(target, source, expected, elapsed)
        if not found.status.ok:
            return found
        covariance = se3.inverse_covariance(found.T_target_source, found.covariance)
        return dataclasses.replace(
            found, T_target_source=se3.inverse(found.T_target_source), covariance=covariance,
            matches=found.matches[:, ::-1], bias=None)

    def _patiently(self, source: RgbdFrame, target: RgbdFrame) -> Registration:
        """Return what AICK finds with all keypoints and the slower schedule."""
        found = self._patient_aick.register(*map(self._all_keypoints, (source, target)))
        # the numbers of these keypoints mean nothing to anybody else
        return dataclasses.replace(found, matches=found.matches[:0])

    def _depth_lag(self, frame: RgbdFrame) -> float:
        """Return how much later than the colour image the depth image was taken [s]."""
        depth_stamp = frame.stamp if frame.depth_stamp is None else frame.depth_stamp
        lag = (depth_stamp - frame.stamp) / NANOSECONDS
        if self._learned.colour_clock.is_behind(frame.stamp):
            return lag  # whatever its depth image, such a frame is not the next one
        return (lag + self._learned.depth_clock.correct(depth_stamp)
                - self._learned.colour_clock.correct(frame.stamp))

    def _refined(self, source: PreparedFrame, target: PreparedFrame, registration: Registration) -> Registration:
        """Return a registration improved; one that failed, or that is not confirmed, fails."""
        if not registration.status.ok:
            return registration
        if source.grey.shape != target.grey.shape:  # the camera has changed its resolution
            return _unchecked(registration, source, target, 0)
        with self._times.stage('refinement'):
            refined = self._refinement.refine(source, target, registration.T_target_source)
        if len(refined.tracked) < _FEWEST_TRACKS:
            return _unchecked(registration, source, target, len(refined.tracked))
        return dataclasses.replace(
            registration, T_target_source=refined.T_target_source, covariance=refined.covariance,
            bias=refined.bias, support=len(refined.tracked),
            tracks=refined.tracked,
            reason=f'{registration.reason}, {len(refined.tracked)} keypoints tracked')

    def _confirmed(self, source: PreparedFrame, target: PreparedFrame, guess: np.ndarray,
                   failure: Registration) -> Registration:
        """Return what a guess comes to, or the failure where the images do not confirm it."""
        registration = self._refined(source, target, dataclasses.replace(
            failure, status=Status.OK, T_target_source=guess, reason='by constant velocity'))
        sought = min(len(source.keypoints), self._settings.refinement.max_tracks)
        enough = max(_FEWEST_TRACKS, _SHARE_OF_TRACKS * sought)
        return registration if registration.support >= enough else failure


def _unchecked(registration: Registration, source: PreparedFrame, target: PreparedFrame,
               tracked: int) -> Registration:
    """Return what is left of a pose that the images do not confirm: nothing, of few matches."""
    reason = f'{registration.reason}, {tracked} keypoints tracked'
    if registration.support < _FEWEST_UNCHECKED:
        return failed(Status.TOO_FEW_MATCHES, reason, registration.iterations)
    covariance = registration.covariance
    if len(registration.matches):
        covariance = fit_covariance(registration.T_target_source, source.keypoints,
                                    target.keypoints, registration.matches)
    return dataclasses.replace(registration, reason=reason, covariance=_DOUBT * covariance)
