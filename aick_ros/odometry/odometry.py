# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Camera motion from a stream of RGB-D frames."""

from __future__ import annotations

import dataclasses
from functools import partial
from typing import Any

import numpy as np

from aick_ros.borders.values import required, required_method
from aick_ros.features.detector import Detector
from aick_ros.frames import depth
from aick_ros.frames.depth_distortion import DepthDistortion
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat, repeat_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER, seconds
from aick_ros.odometry.attempts import Attempt, Attempts
from aick_ros.odometry.effort import Effort
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.increment_bias import IncrementBias
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.keyframe_choice import KeyframeChoice
from aick_ros.odometry.keyframe_memory import KeyframeMemory
from aick_ros.odometry.known_views import known_views
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.other_odometry import OtherOdometry, Predict, no_odometry
from aick_ros.odometry.plane import Plane
from aick_ros.odometry.position_filter import PositionFilter
from aick_ros.odometry.reference import Loss, Reference, References
from aick_ros.odometry.update import OdometryUpdate
from aick_ros.registration.preparation import Preparation
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.registrar import Learned, Registrar
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.registration.systematic_error import (
    errors_of_focal_lengths, errors_of_offset, errors_of_stamps)
from aick_ros.settings import Settings


class Odometry:
    """
    Odometry by registering each frame to a keyframe, or to the last tracked frame.

    Where both fail the frame is registered to earlier ones, newest first. If that fails too its
    pose is predicted by another sensor or at constant velocity, and the next frame is registered
    to this lost one as well. So a bad pair is bridged, a camera that was covered finds back to
    where it was, and after a long loss the odometry continues from the predicted pose.

    A frame whose images are both those of the frame before is no measurement of standing still:
    its pose is that of the motion model or of another sensor, and the next real frame has its
    increment over the whole interval. A sensor at rest has noise, a simulated one may have none:
    images that do not change for longer than the camera needs to stop (``odometry.hold_time``
    and the time by ``odometry.acceleration_sigma``) are taken for rest, unless another sensor
    moves. Where one image repeats it is not used; neither kind of frame becomes a keyframe.

    A frame that is blurred beyond use, beside its keyframe, becomes no keyframe.

    Where keypoints do not determine the motion, depth does as far as the scene has shape. Such a
    frame becomes no keyframe either, and what no shape shows is that of the motion model.

    Poses are added up in a frame of their own, by dead reckoning; the memory of the keyframes
    corrects what is published, and the velocity holds positions that are uncertain.

    :param T_odom_camera: pose of the first frame, 4x4; None: the identity.
    :param detector: used instead of the one that ``features.detector`` names.
    :raises InputError: where the pose is not rigid, or the vocabulary cannot be read.
    """

    def __init__(self, settings: Settings = Settings(), T_odom_camera: np.ndarray | None = None,
                 detector: Detector | None = None) -> None:
        required(settings, Settings, 'settings')
        self._detector = detector
        self._times = StageTimes()
        self._learned = Learned()
        self._gyroscope = Gyroscope(settings.imu, settings.odometry)
        self._gravity = Gravity(settings.imu, self._gyroscope.rotation)
        self._other = OtherOdometry(settings.odometry)
        self._plane = Plane(settings.odometry)
        self._filter = PositionFilter(settings.odometry)
        self._increment_bias = IncrementBias()
        self._memory: KeyframeMemory | None = None
        self._apply(settings, Registrar(settings, self._times, self._learned, detector))
        self.reset(T_odom_camera)

    def change_settings(self, settings: Settings) -> None:
        """
        Continue with other settings from the pose reached.

        Descriptors of two detectors cannot be compared: after a change of ``features.detector``
        the next frame is a first one again, and the motion up to it is not measured.

        :raises InputError: where the vocabulary cannot be read; nothing is changed then.
        """
        registrar = Registrar(settings, self._times, self._learned, self._detector)
        has_changed = settings.features.detector != self._settings.features.detector
        if self._detector is None and has_changed:
            self._begin(self._published, self._is_lost or self._references is not None)
        self._apply(settings, registrar)
        if self._references is not None:
            self._plane.begin(self._pose.matrix)

    def _apply(self, settings: Settings, registrar: Registrar) -> None:
        self._settings = settings
        self._registrar = registrar
        self._motion_model = MotionModel(settings.odometry)
        self._gyroscope.configure(settings.imu, settings.odometry)
        self._gravity.configure(settings.imu)
        self._other.configure(settings.odometry)
        self._plane.configure(settings.odometry)
        self._filter.configure(settings.odometry)
        self._expected = ExpectedMotion(settings.odometry, self._gyroscope, self._other)
        self._attempts = Attempts(settings, registrar, self._expected)
        self._keyframes = KeyframeChoice(settings, registrar)
        if self._memory is not None:
            self._memory.configure(settings, registrar)

    def reset(self, T_odom_camera: np.ndarray | None = None) -> None:
        """
        Forget all frames and the pose; the next frame gets the pose given.

        Without one it gets a level pose by the accelerometer; where there is none, the identity.

        What was learned of the camera is kept.

        :raises InputError: where the pose is not rigid; nothing is changed then.
        """
        pose = np.eye(4) if T_odom_camera is None else se3.checked(T_odom_camera, 'T_odom_camera')
        self._is_placed = T_odom_camera is not None
        self._has_restarted = False  # the recording, so that the camera may be turned otherwise
        self._gravity.reset()
        self._plane.reset()
        self._begin(PoseWithCovariance(pose))

    def _begin(self, pose: PoseWithCovariance, is_lost: bool = False) -> None:
        self._pose = pose
        self._is_lost = is_lost
        self._stamp: int | None = None
        self._twist: np.ndarray | None = None
        self._twist_covariance = np.zeros((6, 6))
        self._unchanged_since = self._confirmed = self._tracked_frames = 0
        self._references: References | None = None
        self._memory = None
        self._filter.reset()
        self._gyroscope.restart()
        self._gravity.restart()
        self._keyframes.begin()

    @property
    def gyroscope(self) -> Gyroscope:
        """The gyroscope, as the motion of the camera has shown it."""
        return self._gyroscope

    @property
    def gravity(self) -> Gravity:
        """The accelerometer, as the motion of the camera has shown it."""
        return self._gravity

    @property
    def misalignment(self) -> Misalignment:
        """Misalignment of the camera's images, where registrations show a significant one."""
        return self._learned.misalignment.misalignment

    @property
    def distortion(self) -> DepthDistortion:
        """Distortion of the depth images, where registrations show a significant one."""
        return self._learned.distortion.distortion

    @property
    def _published(self) -> PoseWithCovariance:
        """The last pose, corrected by keyframes found again, level, held by the motion before."""
        return self._gravity.levelled(self._corrected) @ self._filter.T_measured_filtered

    @property
    def _corrected(self) -> PoseWithCovariance:
        """The last pose, corrected by keyframes found again."""
        return self._pose if self._memory is None else self._memory.published(self._pose)

    def local_map(self) -> np.ndarray:
        """Return the keypoints of the keyframes in memory, in the last camera's frame, Nx3 [m]."""
        if self._memory is None:
            return np.empty((0, 3))
        return self._memory.keypoints_from(self._pose)

    def register_frame(self, frame: RgbdFrame,
                       predict: Predict = no_odometry,
                       T_base_camera: np.ndarray | None = None) -> OdometryUpdate:
        """
        Return pose and motion of the camera at a frame.

        A stamp that repeats or goes back a little is answered with BAD_STAMP and changes nothing;
        one that goes back by more than a second starts a new recording at the pose reached, with
        roll and pitch by the accelerometer where the odometry is level.

        :param predict: motion of the camera by another odometry, as of the wheels.
        :param T_base_camera: extrinsic at the frame, 4x4, for a base that moves in a plane; None:
            the base is the camera, its z axis that of the first pose, given or level.
        :raises InputError: where that motion or the extrinsic is not a rigid transformation; the
            frame counts as lost without an answer, and the next one is registered as if it had
            not been.
        """
        return self.register(self._registrar.preparer.begin(frame), predict, T_base_camera)

    def prepare(self, frame: RgbdFrame) -> Preparation:
        """
        Return a frame with keypoints and surface, free of the distortion of depth known so far.

        It may run on another thread than :meth:`register`, with the next frame meanwhile; that
        makes them again where another distortion is known by then.

        :raises InputError: where the image is too small.
        """
        return self._registrar.preparer.prepare(frame)

    def register(self, preparation: Preparation,
                 predict: Predict = no_odometry,
                 T_base_camera: np.ndarray | None = None) -> OdometryUpdate:
        """Return what :meth:`register_frame` does, of a frame that :meth:`prepare` returned."""
        required(preparation, Preparation, 'the preparation')
        required_method(predict, '__call__', 'predict')
        self._plane.mount(T_base_camera)
        if preparation.preparer is not self._registrar.preparer:  # the settings have changed
            preparation = self._registrar.preparer.begin(preparation.frame)
        self._times.take()
        self._refinements = self._registrar.refinements
        self._other.begin(predict)
        frame = preparation.frame
        if frame.imu is not None:
            self._gyroscope.add(frame.imu)
            self._gravity.add(frame.imu, self._gyroscope.time_offset)
        repeat = self._repeat_of(preparation)
        update = None
        if self._references is not None and repeat is Repeat.BOTH:
            update = self._continue(frame, self._references.last)
        if update is None:
            update = self._register(preparation, repeat)
        self._times.add(preparation.times)
        return update.handed_over(self._times.take())

    def _repeat_of(self, preparation: Preparation) -> Repeat:
        """Return which images are those of the frame before, if that was tracked."""
        if (self._references is None or self._is_lost or self._stamp is None
                or preparation.frame.stamp <= self._stamp):
            return Repeat.NONE
        before = self._references.last.prepared
        return repeat_of(preparation.corrected_for(before.distortion), before.frame)

    def _continue(self, frame: RgbdFrame, last: Reference) -> OdometryUpdate | None:
        """Return the update of a frame whose images repeat; None if they show a camera at rest."""
        unchanged = seconds(self._unchanged_since, frame.stamp)
        if unchanged > self._motion_model.time_to_rest(self._twist):
            moved = self._other.motion(self._unchanged_since, frame.stamp)
            if moved is None or self._other.is_at_rest(moved):
                return None
        self._stamp = frame.stamp
        prepared = dataclasses.replace(
            last.prepared, repeat=Repeat.BOTH,
            frame=dataclasses.replace(frame, depth=last.prepared.frame.depth),
            keypoints=dataclasses.replace(last.prepared.keypoints, stamp=frame.stamp))
        return self._hold(prepared, last, f'unchanged for {unchanged:.2f} s')

    def _hold(self, prepared: PreparedFrame, last: Reference, reason: str) -> OdometryUpdate:
        """Return the update of a frame whose images repeat: its pose is the one expected."""
        elapsed = seconds(last.stamp, prepared.stamp)
        motion = self._expected.without_images(last.stamp, prepared.stamp, self._twist)
        if self._other.motion(last.stamp, prepared.stamp) is None:
            motion = motion.with_covariance(
                motion.covariance + elapsed ** 2 * self._twist_covariance)
        self._pose = self._plane.joined(last.pose @ motion)
        return self._update(prepared, Status.REPEATED, reason,
                            expected=Increment(motion, elapsed))

    def _register(self, preparation: Preparation, repeat: Repeat) -> OdometryUpdate:
        """Return the update of a frame: by tracking, unless AICK has to decide."""
        references, memory = self._references, self._memory
        if (references is None or memory is None
                or not self._may_track(preparation.frame, repeat, references)):
            return self._register_prepared(
                self._registrar.prepared(preparation, repeat))
        prepared, attempt = self._attempts.by_tracking(
            self._registrar.prepared_for_tracking(preparation), references, self._twist,
            self._confirmed)
        if attempt is None or not attempt.status.ok:
            return self._register_prepared(
                self._registrar.with_own_keypoints(prepared),
                attempt.seen.T_target_source if attempt and attempt.seen.is_rough else None)
        self._tracked_frames += 1
        if (self._tracked_frames >= self._settings.odometry.aick_interval
                or self._keyframes.replaces(prepared, attempt)):
            own = self._registrar.with_own_keypoints(prepared)
            if self._registrar.contradicts(own, attempt.reference.prepared,
                                           attempt.seen.T_target_source):
                return self._register_prepared(own)
            self._tracked_frames = 0
        self._stamp = self._unchanged_since = prepared.stamp
        return self._track(prepared, attempt, references, memory)

    def _may_track(self, frame: RgbdFrame, repeat: Repeat, references: References) -> bool:
        """
        Return whether a frame may be tracked, and the keyframe is what it is registered to.

        It is not where its stamp goes back, as by less than an image that repeats has advanced it.
        """
        return (self._settings.odometry.aick_interval > 1
                and repeat is Repeat.NONE and not self._is_lost
                and references.shape is None and not references.is_blurred()
                and self._stamp is not None and self._stamp < frame.stamp)

    def _register_prepared(self, prepared: PreparedFrame,
                           tracked: np.ndarray | None = None) -> OdometryUpdate:
        """Return the update of a frame by AICK; tracked: its rough pose in the keyframe."""
        if self._stamp is not None and prepared.stamp <= self._stamp:
            back = self._stamp - prepared.stamp
            if back <= RESTART_AFTER:
                return self._update(prepared, Status.BAD_STAMP,
                                    f'{back / NANOSECONDS:.6f} s before the last frame')
            self._begin(self._published, is_lost=True)
            self._has_restarted = True
        self._stamp, self._tracked_frames = prepared.stamp, 0
        if prepared.repeat is not Repeat.BOTH:
            self._unchanged_since = prepared.stamp
        if self._references is None or self._memory is None:
            return self._start(prepared)
        failures = []
        views = partial(known_views, self._references, self._memory,
                        settings=self._settings.odometry)
        for attempt in self._attempts.of(prepared, self._references, self._twist,
                                         self._confirmed, views, tracked):
            if attempt.status.ok:
                return self._track(prepared, attempt, self._references, self._memory)
            failures.append(attempt)
        if prepared.repeat is Repeat.COLOUR:
            return self._hold(prepared, self._references.last, 'depth does not show the motion')
        return self._lose(prepared, failures[0], self._references)

    def _start(self, prepared: PreparedFrame) -> OdometryUpdate:
        """Make a frame the first keyframe."""
        count, required = len(prepared.keypoints), self._settings.odometry.min_matches
        if count < required:
            shortage = depth.shortage(prepared.frame.depth, self._settings.sensor)
            reason = f'{count} keypoints with depth, at least {required} are required'
            return self._update(prepared, Status.TOO_FEW_KEYPOINTS,
                                f'{reason}: {shortage}' if shortage else reason)
        recovered, self._is_lost = self._is_lost, False
        self._confirmed = prepared.stamp
        if not self._is_placed and not self._plane.has_base:
            self._pose = self._gravity.begin(prepared.stamp) or self._pose
        elif self._has_restarted:
            self._pose = self._gravity.begin_again(prepared.stamp, self._pose) or self._pose
        self._is_placed, self._has_restarted = True, False
        self._plane.begin(self._pose.matrix)
        first = Reference(prepared, self._pose)
        self._references = References(first)
        self._memory = KeyframeMemory(
            self._settings, self._registrar, first, self._plane.joined)
        return self._update(prepared, Status.FIRST_FRAME, f'{count} keypoints',
                            recovered=recovered)

    def _track(self, prepared: PreparedFrame, attempt: Attempt, references: References,
               memory: KeyframeMemory) -> OdometryUpdate:
        """Add the motion to the pose, and choose the next keyframe."""
        reference, registration = attempt.reference, attempt.registration
        seen = registration.pose
        increment = self._increment(prepared, attempt, references)
        recovered, self._is_lost = self._is_lost, False
        measured = reference.pose.matrix @ seen
        prepared = self._with_velocity(prepared, attempt, increment, measured)
        self._pose = self._plane.joined(reference.pose @ seen)
        last = Reference(prepared, self._plane.joined(reference.pose @ registration.image_pose),
                         in_keyframe=attempt.seen.unbiased_pose, bias=attempt.seen.bias)
        detour = np.zeros((6, 6))
        effort = self._effort_for(prepared, attempt, references)
        interval = seconds(references.last.stamp, prepared.stamp)
        if registration.is_by_depth:
            self._twist = self._motion_model.observed_twist(
                increment, seconds(self._confirmed, prepared.stamp))
        else:
            self._gyroscope.learn(reference.stamp, prepared.stamp, attempt.seen.pose)
            if not references.is_return_to(reference):  # that increment is over all of the gap
                self._twist = increment.twist
            self._confirmed = prepared.stamp
            if reference is not references.keyframe:
                detour = registration.covariance
        self._keyframes.advance(references, last, attempt)
        self._twist_covariance = increment.pose.covariance / increment.interval ** 2
        memory.track(references.keyframe, self._pose.matrix, detour, effort, interval)
        self._gravity.update(prepared.stamp, reference.pose, measured, memory.T_odom_reckoned,
                             self._corrected)
        return self._update(
            prepared, Status.OK, registration.reason, increment=increment, recovered=recovered,
            reference=reference.prepared.keypoints, matches=registration.matches,
            support=registration.support, evidence=registration.evidence)

    def _effort_for(self, prepared: PreparedFrame, attempt: Attempt,
                    references: References) -> Effort:
        """Return the effort that the registration of a frame has taken."""
        if self._registrar.refinements - self._refinements > 1:
            return Effort.MUCH
        by_tracking = self._settings.odometry.aick_interval > 1
        is_shortest = (attempt.reference is references.keyframe
                       and prepared.is_tracked == by_tracking)
        return Effort.LEAST if is_shortest else Effort.MORE

    def _with_velocity(self, prepared: PreparedFrame, attempt: Attempt,
                       increment: Increment, measured: PoseWithCovariance) -> PreparedFrame:
        """Return a tracked frame with its velocity: filtered, as increments have all the noise."""
        twist = self._expected.twist_at(prepared.stamp, increment.twist)
        if not attempt.registration.is_by_depth:
            self._filter.update(prepared.stamp, measured)
            velocity = self._filter.velocity
            if velocity is not None:
                twist = np.concatenate([velocity, twist[3:]])
        return prepared.moving(twist)

    def _increment(self, prepared: PreparedFrame, attempt: Attempt,
                   references: References) -> Increment:
        """Return the motion since the last tracked frame or, after a loss, since the reference."""
        if attempt.reference is not (references.shape or references.keyframe):
            return attempt.increment
        last = references.last
        motion, shown = last.motion_to(attempt.seen)
        if attempt.seen.is_by_depth:
            motion = self._increment_bias.add_to_depth_alone(motion, last.prepared.scene_depth)
        else:
            motion = self._increment_bias.add_to(motion, shown, last.prepared.scene_depth)
        # by depth alone a motion follows depth wholly, by keypoints alone not at all
        gain = attempt.seen.is_by_depth * np.eye(6) if shown is None else shown.gain
        camera = self._learned.misalignment
        offset = errors_of_offset(motion.matrix, camera.offset_covariance, gain)
        focal = errors_of_focal_lengths(motion.matrix, camera.focal_covariance, gain)
        increment = Increment(motion, seconds(last.stamp, prepared.stamp))
        change = np.zeros(6) if self._twist is None else increment.twist - self._twist
        timing = errors_of_stamps(motion.matrix, prepared, last.prepared, change)
        increment = Increment(motion.with_covariance(motion.covariance + offset + focal + timing),
                              increment.interval)
        if attempt.registration.is_by_depth:
            return increment
        increment = self._expected.joined_increment(increment, last.stamp, prepared.stamp)
        loss = references.loss
        if (loss is None or loss.twist is None or attempt.reference.stamp <= loss.last.stamp
                or not self._motion_model.holds(seconds(loss.last.stamp, prepared.stamp))):
            return increment
        doubt = self._expected.doubt(increment.pose.matrix, last.stamp, prepared.stamp, loss.twist)
        return Increment(increment.pose.with_covariance(increment.pose.covariance + doubt),
                         increment.interval)

    def _lose(self, prepared: PreparedFrame, failure: Attempt,
              references: References) -> OdometryUpdate:
        """Predict the pose of a frame that could not be registered."""
        self._is_lost = True
        last = references.last
        self._pose = self._plane.joined(last.pose @ self._expected.without_images(
            last.stamp, prepared.stamp, self._twist))
        if len(prepared.keypoints) >= self._settings.odometry.min_matches:
            references.lose(Reference(prepared, self._pose, loss=self._loss_before(
                prepared.stamp, references)))
        return self._update(
            prepared, failure.status, failure.reason,
            rejected=failure.increment if failure.registration.status.ok else None,
            predicted=self._other.motion(last.stamp, prepared.stamp) is not None)

    def _loss_before(self, stamp: int, references: References) -> Loss:
        """Return what was known before a loss, or before an earlier one that is still in doubt."""
        loss, last = references.loss, references.last
        if loss is not None and self._motion_model.holds(seconds(loss.last.stamp, stamp)):
            return loss
        holds = self._motion_model.holds(seconds(last.stamp, stamp))
        return Loss(last.bare(), self._twist if holds else None)

    def _update(self, prepared: PreparedFrame, status: Status, reason: str,
                **details: Any) -> OdometryUpdate:
        """Return the update of a frame at the pose reached, with details as of its class."""
        return OdometryUpdate(prepared.stamp, status, reason, self._published, prepared,
                              level_start=self._gravity.start, **details)
