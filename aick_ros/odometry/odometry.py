# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Camera motion from a stream of RGB-D frames."""

from __future__ import annotations

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
from aick_ros.geometry.pose import Increment
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER, seconds
from aick_ros.odometry.attempts import Attempt, Attempts
from aick_ros.odometry.effort import Effort
from aick_ros.odometry.expected_motion import ExpectedMotion
from aick_ros.odometry.frame_order import FrameOrder
from aick_ros.odometry.increment_bias import IncrementBias
from aick_ros.odometry.increments import Increments
from aick_ros.odometry.inertial.accelerometer import Accelerometer
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.inertial.level import Turn
from aick_ros.odometry.keyframe_choice import KeyframeChoice
from aick_ros.odometry.known_views import known_views
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.other_odometry import OtherOdometry, Predict, no_odometry
from aick_ros.odometry.path import Path
from aick_ros.odometry.plane import Plane
from aick_ros.odometry.reference import Reference, References
from aick_ros.odometry.repeated_images import RepeatedImages, repeated
from aick_ros.odometry.tracking import Tracking
from aick_ros.odometry.unsteadiness import Unsteadiness
from aick_ros.odometry.update import OdometryUpdate
from aick_ros.odometry.velocity import Velocity
from aick_ros.odometry.velocity_change import VelocityChange
from aick_ros.registration.depth_alone import shows_enough
from aick_ros.registration.learned import Learned
from aick_ros.registration.preparation import Preparation
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
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
    increment over the whole interval. Images of a camera without noise, as of a simulation, that
    do not change for longer than the camera needs to stop (``odometry.hold_time`` and the time by
    ``odometry.acceleration_sigma``) are taken for rest, unless another sensor moves. Where one
    image repeats it is not used.

    Where keypoints do not determine the motion, depth does as far as the scene has shape, and
    what no shape shows is that of the motion model. None of these frames becomes a keyframe, nor
    does one that is blurred beyond use, beside its keyframe.

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
        self._increment_bias, self._velocity_change = IncrementBias(), VelocityChange()
        self._unsteadiness = Unsteadiness()
        self._gyroscope = Gyroscope(settings.imu, settings.odometry)
        self._other = OtherOdometry(settings.odometry)
        self._path = Path(settings, self._gyroscope.rotation)
        self._accelerometer = Accelerometer(self._path.gravity, self._gyroscope, settings.imu,
                                            settings.odometry)
        self._tracking = Tracking()
        self._refinements = 0  # of the registrar, before this frame
        self._apply(settings, Registrar(settings, self._times, self._learned, detector))
        self.reset(T_odom_camera)

    def change_settings(self, settings: Settings) -> None:
        """
        Continue with other settings from the pose reached.

        Keypoints of two detectors, or of two settings of one, cannot be compared. So frames that
        are kept are prepared again, each where a frame is next registered to it.

        :raises InputError: where the vocabulary cannot be read; nothing is changed then.
        """
        self._apply(settings, Registrar(settings, self._times, self._learned, self._detector))

    def _apply(self, settings: Settings, registrar: Registrar) -> None:
        self._settings = settings
        self._registrar = registrar
        self._gyroscope.configure(settings.imu, settings.odometry)
        self._accelerometer.configure(settings.imu, settings.odometry)
        self._other.configure(settings.odometry)
        self._path.configure(settings, registrar)
        self._motion_model = MotionModel(settings.odometry)
        self._expected = ExpectedMotion(settings.odometry, self._gyroscope, self._other,
                                        self._accelerometer)
        self._attempts = Attempts(settings, registrar, self._expected)
        self._increments = Increments(self._expected, self._motion_model,
                                      self._learned.misalignment, self._increment_bias,
                                      self._velocity_change,
                                      settings.sensor.depth_scale_sigma)
        self._repeated = RepeatedImages(self._motion_model, self._expected, self._other,
                                        self._learned.noise)
        self._keyframes = KeyframeChoice(settings, registrar)
        self._tracking.configure(settings, registrar, self._attempts, self._keyframes)

    def reset(self, T_odom_camera: np.ndarray | None = None) -> None:
        """
        Forget all frames and the pose; the next frame gets the pose given.

        Without one it gets a level pose by the accelerometer; where there is none, the identity.

        What was learned of the camera is kept.

        :raises InputError: where the pose is not rigid; nothing is changed then.
        """
        self._path.reset(T_odom_camera)
        self._order = FrameOrder()
        self._begin()

    def _begin(self, is_lost: bool = False) -> None:
        self._is_lost = is_lost
        self._velocity = Velocity()
        self._references: References | None = None
        self._gyroscope.restart()
        self._accelerometer.restart()
        self._other.restart()
        self._keyframes.begin()
        self._tracking.restart()

    @property
    def gyroscope(self) -> Gyroscope:
        """The gyroscope, as the motion of the camera has shown it."""
        return self._gyroscope

    @property
    def gravity(self) -> Gravity:
        """The accelerometer, as the motion of the camera has shown it."""
        return self._path.gravity

    @property
    def plane(self) -> Plane:
        """The plane that the base moves in, if there is one, as the camera has shown it."""
        return self._path.plane

    @property
    def misalignment(self) -> Misalignment:
        """Misalignment of the camera's images, where registrations show one for certain."""
        return self._learned.misalignment.found

    @property
    def distortion(self) -> DepthDistortion:
        """Distortion of the depth images, where registrations show a significant one."""
        return self._learned.distortion.distortion

    def begin_level(self, sigma: float) -> Turn | None:
        """
        Let the odometry have begun level by what is known of gravity now.

        It is for whoever has called ``gravity.hold()`` before the first frame and holds the
        updates back, as :func:`aick_ros.odometry.level_start.begun_level` does.

        :param sigma: largest standard deviation of the direction of gravity [rad].
        :returns: the turn of the updates so far, or of those before another recording that has
            ended the hold; None: they stay, as less is known.
        """
        return self._path.begin_level(sigma)

    def local_map(self) -> np.ndarray:
        """Return the keypoints of the keyframes in memory, in the last camera's frame, Nx3 [m]."""
        return self._path.local_map()

    def register_frame(self, frame: RgbdFrame,
                       predict: Predict = no_odometry,
                       T_base_camera: np.ndarray | None = None) -> OdometryUpdate:
        """
        Return pose and motion of the camera at a frame.

        A stamp that repeats or goes back a little is answered with BAD_STAMP; of that frame the
        samples of the IMU alone are used. One that goes back by more than a second starts a new
        recording at the pose reached, with roll and pitch by the accelerometer where the odometry
        is level.

        :param predict: motion of the camera by another odometry, as of the wheels.
        :param T_base_camera: extrinsic at the frame, 4x4, for a base that moves in a plane; None:
            the base is the camera, its z axis that of the first pose, given or level.
        :raises InputError: where the image is too small, or that motion or the extrinsic is not a
            rigid transformation; nothing is tracked then, and the next frame is registered to
            the same references.
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
        self._path.mount(T_base_camera)
        if preparation.preparer is not self._registrar.preparer:  # the settings have changed
            preparation = self._registrar.preparer.begin(preparation.frame)
        self._times.take()
        self._refinements = self._registrar.refinements
        self._other.begin(predict)
        frame = preparation.frame
        if frame.imu is not None:
            self._gyroscope.add(frame.imu)
            self._path.gravity.add(frame.imu, self._gyroscope.time_offset,
                                   self._gyroscope.mounting)
        repeat = self._repeat_of(preparation)
        update = None
        if self._references is not None and repeat is Repeat.BOTH:
            update = self._repeat(frame, self._references.last)
        if update is None:
            update = self._register(preparation, repeat)
        self._times.add(preparation.times)
        return update.handed_over(self._times.take())

    def _repeat_of(self, preparation: Preparation) -> Repeat:
        """Return which images are those of the frame before, if that was tracked."""
        if (self._references is None or self._is_lost
                or not self._order.is_next(preparation.frame.stamp)):
            return Repeat.NONE
        before = self._references.last.prepared
        return repeat_of(preparation.corrected_for(before.distortion), before.frame)

    def _repeat(self, frame: RgbdFrame, last: Reference) -> OdometryUpdate | None:
        """Return the update of a frame whose images repeat; None if they show a camera at rest."""
        since = self._order.unchanged_since(frame.stamp)
        if self._repeated.show_rest(since, frame.stamp, self._velocity, last.stamp):
            return None
        self._order.advance(frame.stamp, is_new=False)
        return self._hold(repeated(last.prepared, frame), last,
                          f'unchanged for {seconds(since, frame.stamp):.2f} s')

    def _hold(self, prepared: PreparedFrame, last: Reference, reason: str) -> OdometryUpdate:
        """Return the update of a frame whose images repeat: its pose is the one expected."""
        expected = self._repeated.motion(last.stamp, prepared.stamp, self._velocity)
        self._path.move_to(last.pose @ expected.pose)
        return self._update(prepared, Status.REPEATED, reason, expected=expected)

    def _register(self, preparation: Preparation, repeat: Repeat) -> OdometryUpdate:
        """Return the update of a frame: by tracking, unless AICK has to decide."""
        references = self._references
        if references is None or not self._may_track(preparation.frame, repeat, references):
            return self._register_prepared(self._registrar.prepared(preparation, repeat))
        prepared, attempt, rough = self._tracking.register(
            preparation, references, self._velocity)
        if attempt is None:
            return self._register_prepared(prepared, rough)
        self._order.advance(prepared.stamp)
        return self._track(prepared, attempt, references)

    def _may_track(self, frame: RgbdFrame, repeat: Repeat, references: References) -> bool:
        """
        Return whether a frame may be tracked, and the keyframe is what it is registered to.

        It is not where its stamp goes back, as by less than an image that repeats has advanced it.
        """
        return (self._tracking.is_used and repeat is Repeat.NONE and not self._is_lost
                and references.depth_reference is None and not references.is_blurred()
                and self._order.is_next(frame.stamp))

    def _register_prepared(self, prepared: PreparedFrame,
                           rough: np.ndarray | None = None) -> OdometryUpdate:
        """Return the update of a frame by AICK; rough: its pose in the keyframe by tracking."""
        back = self._order.back(prepared.stamp)
        if back is not None:
            if back <= RESTART_AFTER:
                return self._update(prepared, Status.BAD_STAMP,
                                    f'{back / NANOSECONDS:.6f} s before the last frame')
            self._path.restart()
            self._begin(is_lost=True)
        self._order.advance(prepared.stamp, is_new=prepared.repeat is not Repeat.BOTH)
        self._tracking.restart()
        if self._references is None:
            return self._start(prepared)
        failures = []
        views = partial(known_views, self._references, self._path.views_beside,
                        settings=self._settings.odometry)
        for attempt in self._attempts.of(prepared, self._references, self._velocity, views, rough):
            if attempt.status.ok:
                return self._track(prepared, attempt, self._references)
            failures.append(attempt)
        if prepared.repeat is Repeat.COLOUR:
            return self._hold(prepared, self._references.last, 'depth does not show the motion')
        if prepared.repeat is Repeat.DEPTH and not self._has_keypoints(prepared):
            return self._hold(prepared, self._references.last,
                              f'depth repeats, {len(prepared.keypoints)} keypoints')
        return self._lose(prepared, failures[0], self._references)

    def _start(self, prepared: PreparedFrame) -> OdometryUpdate:
        """Make a frame the first keyframe."""
        count, least = len(prepared.keypoints), self._settings.odometry.min_matches
        is_by_depth = not self._has_keypoints(prepared)
        if is_by_depth and not shows_enough(prepared):
            shortage = depth.shortage(prepared.frame.depth, self._settings.sensor)
            reason = f'{count} keypoints with depth, at least {least} are required'
            return self._update(prepared, Status.TOO_FEW_KEYPOINTS,
                                f'{reason}: {shortage}' if shortage else reason)
        recovered, self._is_lost = self._is_lost, False
        self._velocity = Velocity(confirmed=prepared.stamp,
                                  unsteadiness=self._unsteadiness.squares)
        first, reason = self._path.start(prepared), f'{count} keypoints'
        self._references = References(first)
        if is_by_depth:
            self._references.track_by_depth(first, first)
            reason += ', by depth alone'
        return self._update(prepared, Status.FIRST_FRAME, reason, recovered=recovered)

    def _has_keypoints(self, prepared: PreparedFrame) -> bool:
        """Return whether a frame has as many keypoints as a registration needs."""
        return len(prepared.keypoints) >= self._settings.odometry.min_matches

    def _track(self, prepared: PreparedFrame, attempt: Attempt,
               references: References) -> OdometryUpdate:
        """Add the motion to the pose, and choose the next keyframe."""
        reference, registration = attempt.reference, attempt.registration
        increment = self._increments.of(prepared, attempt, references, self._velocity.twist)
        recovered, self._is_lost = self._is_lost, False
        prepared = self._with_velocity(prepared, attempt, increment)
        last = Reference(prepared, self._path.fused(reference.pose @ registration.image_pose),
                         in_keyframe=attempt.seen.unbiased_pose, bias=attempt.seen.bias,
                         by_readout=attempt.seen.by_readout,
                         is_by_colour=attempt.seen.is_by_colour)
        effort = self._effort_for(prepared, attempt, references)
        interval = seconds(references.last.stamp, prepared.stamp)
        detour = np.zeros((6, 6))
        if registration.is_by_depth:
            self._velocity = self._velocity.by_depth(increment, prepared.stamp, self._motion_model)
        else:
            self._gyroscope.learn(reference.stamp, prepared.stamp, attempt.seen.pose)
            self._unsteadiness.learn(increment, prepared.stamp)
            velocity = Velocity.by_keypoints(increment, prepared.stamp, self._unsteadiness.squares)
            if references.is_return_to(reference):  # that increment is over all of the gap
                velocity = velocity.with_twist(self._velocity.twist)
            self._velocity = velocity
            if reference is not references.keyframe:
                detour = registration.covariance
        self._keyframes.advance(references, last, attempt)
        self._path.track(prepared.stamp, reference.pose, registration.pose, references.keyframe,
                         detour, interval, effort)
        if not registration.is_by_depth:
            self._accelerometer.learn(prepared.stamp, last.pose.matrix)
        registered_to = self._registrar.prepared_like(reference.prepared, prepared)
        return self._update(
            prepared, Status.OK, registration.reason, increment=increment, recovered=recovered,
            reference=registered_to.keypoints, matches=registration.matches,
            support=registration.support, evidence=registration.evidence)

    def _with_velocity(self, prepared: PreparedFrame, attempt: Attempt,
                       increment: Increment) -> PreparedFrame:
        """Return a tracked frame with its velocity: filtered, as increments have all the noise."""
        twist = self._expected.twist_at(prepared.stamp, increment.twist)
        if not attempt.registration.is_by_depth:
            velocity = self._path.velocity_at(
                prepared.stamp, attempt.reference.pose.matrix @ attempt.registration.pose)
            if velocity is not None:
                twist = np.concatenate([velocity, twist[3:]])
        interval = min(increment.interval, self._settings.odometry.hold_time)  # also after a loss
        return prepared.moving(twist, self._velocity.variances_after(interval))

    def _effort_for(self, prepared: PreparedFrame, attempt: Attempt,
                    references: References) -> Effort:
        """Return the effort that the registration of a frame has taken."""
        if self._registrar.refinements - self._refinements > 1:
            return Effort.MUCH
        is_shortest = (attempt.reference is references.keyframe
                       and prepared.is_tracked == self._tracking.is_used)
        return Effort.LEAST if is_shortest else Effort.MORE

    def _lose(self, prepared: PreparedFrame, failure: Attempt,
              references: References) -> OdometryUpdate:
        """Predict the pose of a frame that could not be registered."""
        self._is_lost = references.is_lost = True
        last = references.last
        # increments by colour alone have so much noise that the filtered velocity errs less
        twist = last.prepared.twist if last.is_by_colour else self._velocity.twist
        pose = self._path.move_to(last.pose @ self._expected.without_images(
            last.stamp, prepared.stamp, twist))
        lost = Reference(prepared, pose, loss=references.loss_before(
            prepared.stamp, twist, self._motion_model))
        if self._has_keypoints(prepared):
            references.lose(lost)
        elif shows_enough(prepared):
            references.lose_in_the_dark(lost)
        return self._update(
            prepared, failure.status, failure.reason,
            rejected=failure.increment if failure.registration.status.ok else None,
            predicted=self._expected.is_measured(last.stamp, prepared.stamp, twist))

    def _update(self, prepared: PreparedFrame, status: Status, reason: str,
                **details: Any) -> OdometryUpdate:
        """Return the update of a frame at the pose reached, with details as of its class."""
        return OdometryUpdate(prepared.stamp, status, reason, self._path.published, prepared,
                              level_start=self._path.gravity.start, **details)
