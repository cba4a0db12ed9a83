# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""From two frames to one pose with its covariance: keypoints, AICK, refinement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.borders.values import numbers, required
from aick_ros.features.detector import Detector
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Surface
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.registration.aick.aick import Aick
from aick_ros.registration.common_preparation import CommonDistortion, CommonPreparation
from aick_ros.registration.depth_alone import DepthAlone
from aick_ros.registration.depth_pair import KnownView
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.learned import Learned
from aick_ros.registration.preparation import Preparation, Preparer
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.refinement.refinement import Refinement
from aick_ros.registration.result import Registration, failed
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.registration.tracked_keypoints import TrackedKeypoints
from aick_ros.registration.unexpected_motion import NEAR_POSE, is_same
from aick_ros.registration.verified_aick import VerifiedAick
from aick_ros.settings import Settings

_STRONGEST = 200
"""Number of keypoints by which AICK checks a pose.

Chosen: on two excerpts of real recordings and five rendered ones it finds and contradicts what it
does with 275; with 100 it contradicts twice as often."""

_TARGETS = 4  # by definition: three by keypoints at most, and one by depth alone
_VIEWS = 8  # chosen: the target of a frame without keypoints, and views beside, which come and go

_FORGOTTEN = 60  # registrations by keypoints after which surfaces for depth alone go; chosen


class Registrar:
    """
    Registers frames of one camera to each other.

    :param times: adds up the time of each stage.
    :param learned: of the camera, by other registrars too; registrations add to it.
    :param detector: used instead of the one that ``features.detector`` names.
    :raises InputError: if the vocabulary of the settings cannot be read.
    """

    def __init__(self, settings: Settings = Settings(),
                 times: StageTimes | None = None, learned: Learned | None = None,
                 detector: Detector | None = None) -> None:
        self._times = StageTimes() if times is None else required(times, StageTimes, 'times')
        self._preparer = Preparer(settings, detector)
        self._aick = Aick(settings.aick)
        self._learned = Learned() if learned is None else required(learned, Learned, 'learned')
        self._depth_alone = DepthAlone(settings, self._learned.noise, self._learned.misalignment)
        refinement = None if settings.refinement.mode == 'none' else Refinement(
            settings.refinement, settings.sensor, self._learned.noise, self._learned.misalignment)
        self._refinement = refinement
        self._verified = None if refinement is None else VerifiedAick(
            settings, self._aick, refinement, self._learned.noise, self._times, detector)
        self._tracked_keypoints = None if refinement is None else TrackedKeypoints(
            settings, refinement)
        self._learned.misalignment.assume(Misalignment.by(settings.misalignment))
        self._preparer.distortion = self._learned.distortion.distortion
        self._own_keypoints = LastResults(self._preparer.keypoints, 1)
        self._alike = CommonPreparation(self._preparer, _TARGETS)
        self._depth_alike = CommonDistortion(self._preparer, _VIEWS)
        self._since_depth_alone = 0  # registrations by keypoints

    @property
    def preparer(self) -> Preparer:
        """The maker of keypoints and surfaces; it may be used on another thread."""
        return self._preparer

    @property
    def refinements(self) -> int:
        """Number of refinements so far, those of checks among them."""
        return 0 if self._refinement is None else self._refinement.count

    def prepare(self, frame: RgbdFrame, repeat: Repeat = Repeat.NONE) -> PreparedFrame:
        """
        Return what registrations need of a frame; frames come in the order of their stamps.

        :param repeat: images that are those of the frame before.
        """
        preparation = self._preparer.begin(frame)
        prepared = self.prepared(preparation, repeat)
        self._times.add(preparation.times)
        return prepared

    def prepared(self, preparation: Preparation, repeat: Repeat = Repeat.NONE) -> PreparedFrame:
        """
        Return a frame with its preparation; frames come in the order of their stamps.

        :param repeat: images that are those of the frame before; a depth image that repeats is
            not used: it shows another moment than the colour image.
        """
        preparation = self._up_to_date(preparation)
        keypoints = preparation.keypoints()
        surface = None if repeat is Repeat.DEPTH else preparation.surface()
        return self._prepared(preparation, keypoints, surface, repeat)

    def prepared_for_tracking(self, preparation: Preparation) -> PreparedFrame:
        """Return what tracking needs of a frame, as :meth:`prepared` does: without keypoints."""
        preparation = self._up_to_date(preparation)
        none = KeypointFrame.none(preparation.frame.stamp)
        return self._prepared(preparation, none, preparation.surface(), Repeat.NONE)

    def _up_to_date(self, preparation: Preparation) -> Preparation:
        """Return a preparation by what is known of the distortion of the image of its camera."""
        required(preparation, Preparation, 'the preparation')
        self._learned.follow(preparation.frame.camera)
        self._preparer.distortion = self._learned.distortion.distortion
        return preparation.up_to_date()

    def with_own_keypoints(self, prepared: PreparedFrame) -> PreparedFrame:
        """Return a frame that was prepared for tracking as :meth:`prepared` would."""
        required(prepared, PreparedFrame, 'the frame')
        with self._times.stage('features'):
            keypoints = self._own_keypoints(prepared.frame)
        return prepared.with_keypoints(keypoints, is_tracked=False)

    def _prepared(self, preparation: Preparation, keypoints: KeypointFrame,
                  surface: Surface | None, repeat: Repeat) -> PreparedFrame:
        frame = preparation.corrected()
        return PreparedFrame(frame, keypoints, frame.grey, surface, self._learned.depth_lag(frame),
                             self._learned.colour_clock.jitter, repeat,
                             distortion=preparation.distortion,
                             settings=self._preparer.settings,
                             clock_correction=self._learned.colour_clock.correction)

    def register(self, source: PreparedFrame, target: PreparedFrame,
                 expected: ExpectedPose | None = None,
                 tracked: np.ndarray | None = None) -> Registration:
        """
        Return the pose of the source in the target.

        :param expected: what is known of the motion; None: nothing is.
        :param tracked: a rough pose that :meth:`track` has returned, 4x4. Where AICK finds about
            the same, or none at once, the refinement begins there. None: there is none.
        :raises InputError: where the frames are not prepared, a pose is not rigid, or the time is
            less than 1 ns.
        """
        _require_frames(source, target)
        if expected is not None:
            expected = required(expected, ExpectedPose, 'the pose expected').checked()
        if tracked is not None:
            tracked = se3.checked(tracked, 'the pose tracked')
        target = self._alike(target, source)
        if self._verified is None:
            with self._times.stage('registration'):
                return self._aick.register(source.keypoints, target.keypoints)
        found = self._verified.register(source, target, expected, tracked)
        return self._taught_by(found, source, target, expected)

    def prepared_like(self, target: PreparedFrame, source: PreparedFrame) -> PreparedFrame:
        """
        Return the target as the source is registered to it.

        That is prepared by the same settings, and free of the same distortion.
        """
        _require_frames(source, target)
        return self._alike(target, source)

    def prepared_again(self, prepared: PreparedFrame) -> PreparedFrame:
        """Return a frame of other settings prepared by those of now; others are returned as is."""
        return self._alike.prepared_again(required(prepared, PreparedFrame, 'the frame'))

    def track(self, source: PreparedFrame, target: PreparedFrame,
              expected: ExpectedPose) -> tuple[PreparedFrame, Registration]:
        """
        Return the source with keypoints of the target tracked into it, and its pose in the target.

        It fails without a refinement, and where AICK has to decide; its pose is rough then, if it
        has one. Parameters as for :meth:`register`.
        """
        _require_frames(source, target)
        expected = required(expected, ExpectedPose, 'the pose expected').checked()
        if self._tracked_keypoints is None:
            return source, failed(Status.TOO_FEW_MATCHES, 'no refinement')
        target = self._alike(target, source)
        with self._times.stage('refinement'):
            source, found = self._tracked_keypoints.register(source, target, expected)
        return source, self._taught_by(found, source, target, expected)

    def register_colour(self, source: PreparedFrame, target: PreparedFrame,
                        expected: ExpectedPose, is_followed: bool = False) -> Registration:
        """
        Return the pose of the source in the target by its colour image alone.

        The depth of the target places its keypoints. It fails without a refinement; other
        parameters are as for :meth:`register`.

        :param is_followed: whether the frame before was not lost, so that fewer keypoints suffice.
        """
        _require_frames(source, target)
        expected = required(expected, ExpectedPose, 'the pose expected').checked()
        if self._tracked_keypoints is None:
            return failed(Status.TOO_FEW_MATCHES, 'no refinement')
        target = self._alike(target, source)
        with self._times.stage('refinement'):
            found = self._tracked_keypoints.register_without_depth(
                source, target, expected, is_followed)
        return self._taught_by(found, source, target, expected)

    def contradicts(self, source: PreparedFrame, target: PreparedFrame,
                    T_target_source: np.ndarray) -> bool:
        """
        Return whether AICK, without a guess, finds another pose than one that was tracked.

        Where it finds none in one attempt it does not. The strongest keypoints of each decide.
        """
        _require_frames(source, target)
        with self._times.stage('registration'):
            aligned = self._aick.align(*(frame.keypoints[:_STRONGEST] for frame in (
                source, self._alike(target, source))))
        return aligned.status.ok and not is_same(aligned.T_target_source, T_target_source,
                                                 NEAR_POSE)

    def _taught_by(self, found: Registration, source: PreparedFrame, target: PreparedFrame,
                   expected: ExpectedPose | None) -> Registration:
        """Learn from a registration; return it with the errors that it does not show itself."""
        self._forget_depth_alone(found)
        found = self._learned.learn(found, source, target)
        self._preparer.distortion = self._learned.distortion.distortion
        return self._learned.with_systematic_errors(found, source, target, expected)

    def _forget_depth_alone(self, found: Registration) -> None:
        """Forget what depth alone needed, some time after it."""
        self._since_depth_alone += found.status.ok
        if self._since_depth_alone == _FORGOTTEN:
            self._depth_alone.forget()
            self._depth_alike.forget()

    def align(self, source: PreparedFrame, target: PreparedFrame) -> Registration:
        """Return the pose of the source in the target by AICK in one attempt, not refined."""
        _require_frames(source, target)
        with self._times.stage('registration'):
            return self._aick.align(source.keypoints,
                                    self._alike(target, source).keypoints)

    def recognize(self, source: PreparedFrame, target: PreparedFrame) -> Registration:
        """
        Return the pose of the source in the target, of two frames that may show the same place.

        It is found by appearance alone, in one attempt. Nothing is learned of the camera: the two
        may as well show places that look alike.
        """
        _require_frames(source, target)
        target = self._alike(target, source)
        if self._verified is None:
            with self._times.stage('registration'):
                return self._aick.register(source.keypoints, target.keypoints)
        return self._learned.recognized(self._verified.recognize(source, target), source, target)

    def recognize_partly(self, source: PreparedFrame, target: PreparedFrame,
                         aligned: Registration) -> Registration:
        """
        Return what :meth:`recognize` does after :meth:`align`, in parts that each take less time.

        :param aligned: what either of the two has returned before: a rough one goes on.
        """
        _require_frames(source, target)
        required(aligned, Registration, 'the registration')
        if self._verified is None:
            return aligned
        target = self._alike(target, source)
        found = self._verified.recognize_partly(source, target, aligned)
        return found if found.is_rough else self._learned.recognized(found, source, target)

    def register_depth(self, source: PreparedFrame, target: PreparedFrame,
                       expected: PoseWithCovariance, unobserved: np.ndarray,
                       others: Sequence[KnownView] = ()) -> Registration:
        """
        Return the pose of the source in the target by depth alone, whatever the keypoints.

        :param expected: ``T_target_source`` by the motion model since the last frame.
        :param unobserved: 6x6, the covariance of the pose if no frame had been registered since
            keypoints were last seen.
        :param others: views beside the target.
        :raises InputError: where the frames are not prepared, or the others are of another kind.
        """
        _require_frames(source, target)
        required(expected, PoseWithCovariance, 'the pose expected')
        unobserved = numbers(unobserved, (6, 6), 'the covariance unobserved')
        with self._times.stage('refinement'):
            self._since_depth_alone = 0
            target = self._depth_alike(target, source)
            others = [replaced(view, prepared=self._depth_alike(view.prepared, source))
                      for view in others]
            return self._depth_alone.register(source, target, expected, unobserved, others)


def _require_frames(source: PreparedFrame, target: PreparedFrame) -> None:
    required(source, PreparedFrame, 'the source')
    required(target, PreparedFrame, 'the target')
