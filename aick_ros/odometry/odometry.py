# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Camera motion from a stream of RGB-D frames."""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from aick_ros.features.detector import Detector
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER
from aick_ros.odometry.keyframe import Anchor, KeyframePolicy, OneFrame
from aick_ros.odometry.local_map import LocalMap
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.update import OdometryUpdate
from aick_ros.registration.registrar import Learned, Registrar
from aick_ros.registration.result import Evidence, Registration
from aick_ros.registration.stage_times import StageTimes
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings, Settings

_SLIP, _LEAST_SLIP = 0.1, 0.01
"""How sure a predicted motion is: a share of it, and at least so much [m, rad]."""

_EARLIER, _EARLIER_APART = 3, 0.3
"""How many earlier frames a lost one is tried against, and their least distance [s]."""

Predict = Callable[[int, int], np.ndarray | None]
"""From two stamps [ns] to ``T_camera0_camera1`` as another sensor has it; None: it has none."""


class Odometry:
    """
    Odometry by registering each frame to the keyframe, or to the last tracked frame.

    Where both fail the frame is tried against earlier ones, then its pose is the one predicted,
    or held at constant velocity, and the next frame is tried against the lost one, too: so one
    bad pair is bridged, a camera that was covered finds back to where it was, and after a long
    loss the pose goes on from where it was held.

    :param T_odom_camera: pose of the first frame; None: the identity.
    :param detector: used instead of the one that ``features.detector`` names.
    """

    def __init__(self, settings: Settings = Settings(), T_odom_camera: np.ndarray | None = None,
                 detector: Detector | None = None) -> None:
        self._detector = detector
        self._times = StageTimes()
        self._learned = Learned()
        self._detector_name = settings.features.detector
        self._take(settings, Registrar(settings, self._times, self._learned, self._detector))
        self.reset(T_odom_camera)

    def change_settings(self, settings: Settings) -> None:
        """
        Go on with other settings from the pose reached.

        Descriptors of two detectors cannot be compared: after a change of it the next frame is a
        first one again, and the motion up to it is not seen.

        :raises InputError: where the vocabulary cannot be read; nothing is changed then.
        """
        registrar = Registrar(settings, self._times, self._learned, self._detector)
        if self._detector is None and settings.features.detector != self._detector_name:
            self._detector_name = settings.features.detector
            self._forget(self._pose, self._covariance, is_lost=self._tracked is not None)
        self._take(settings, registrar)

    def _take(self, settings: Settings, registrar: Registrar) -> None:
        self._settings: OdometrySettings = settings.odometry
        self._motion_model = MotionModel(settings.odometry)
        self._registrar = registrar
        self._policy = KeyframePolicy(settings)
        # without a refinement nothing is tracked that could be fused
        fused = settings.odometry.reference == 'map' and settings.refinement.mode != 'none'
        self._reference = LocalMap(settings) if fused else OneFrame()

    def reset(self, T_odom_camera: np.ndarray | None = None) -> None:
        """Forget everything; the next frame gets the pose given, or the identity."""
        pose = np.eye(4) if T_odom_camera is None else T_odom_camera
        self._forget(pose, np.zeros((6, 6)))

    def register_frame(self, frame: RgbdFrame,
                       predict: Predict = lambda before, now: None) -> OdometryUpdate:
        """
        Return where the camera was at a frame.

        A stamp that repeats or goes back a little is answered with BAD_STAMP and changes nothing;
        one that goes back by more than a second starts a new recording at the pose reached.

        :param predict: motion of the camera by another sensor, called if the frame is lost.
        """
        self._times.take()
        update = self._register(self._registrar.prepare(frame), predict)
        return dataclasses.replace(update, timing=self._times.take())

    def _forget(self, pose: np.ndarray, covariance: np.ndarray, is_lost: bool = False) -> None:
        self._pose, self._covariance = pose, covariance
        self._twist: np.ndarray | None = None
        self._stamp: int | None = None
        self._tracked: Anchor | None = None
        self._keyframe: Anchor | None = None
        self._policy.begin()
        self._earlier: deque[Anchor] = deque(maxlen=_EARLIER)
        self._lost: Anchor | None = None
        self._is_lost = is_lost

    def _register(self, prepared: PreparedFrame, predict: Predict) -> OdometryUpdate:
        if self._stamp is not None and prepared.stamp <= self._stamp:
            back = self._stamp - prepared.stamp
            if back <= RESTART_AFTER:
                return self._answer(prepared, Status.BAD_STAMP,
                                    f'{back / NANOSECONDS:.6f} s before the last frame')
            self._forget(self._pose, self._covariance, is_lost=True)
        self._stamp = prepared.stamp
        if self._tracked is None:
            return self._start(prepared)
        failure = None
        for anchor in self._anchors():
            interval = (prepared.stamp - anchor.prepared.stamp) / NANOSECONDS
            registration = self._reference.register(
                self._registrar, prepared, anchor.prepared, self._expected(prepared, anchor),
                self._elapsed(prepared))
            status, reason = self._judge(registration, interval)
            if status.ok:
                return self._track(prepared, anchor, registration)
            failure = failure or (status, reason, registration, interval)
        status, reason, refused, interval = failure
        held = self._hold(prepared, status, reason, predict)
        if not refused.status.ok:
            return held
        return dataclasses.replace(held, rejected=Increment(
            PoseWithCovariance(refused.T_target_source, refused.covariance), interval))

    def _start(self, prepared: PreparedFrame) -> OdometryUpdate:
        fewest = self._settings.min_matches
        if len(prepared.keypoints) < fewest:
            return self._answer(
                prepared, Status.TOO_FEW_KEYPOINTS,
                f'{len(prepared.keypoints)} keypoints with depth, at least {fewest} are required')
        recovered, self._is_lost = self._is_lost, False
        self._tracked = self._keyframe = Anchor(self._reference.start(prepared), self._pose,
                                                self._covariance)
        return self._answer(prepared, Status.FIRST_FRAME, f'{len(prepared.keypoints)} keypoints',
                            recovered=recovered)

    def _anchors(self) -> Iterator[Anchor]:
        """Yield what a frame is tried against, until one holds."""
        yield self._keyframe
        if self._tracked is not self._keyframe:
            yield self._tracked
        yield from reversed(self._earlier)
        if self._lost is not None:
            yield self._lost

    def _expected(self, prepared: PreparedFrame, anchor: Anchor) -> np.ndarray | None:
        """Return where the view is seen from an anchor at constant velocity, 4x4."""
        elapsed = self._elapsed(prepared)
        if self._twist is None or not self._motion_model.holds(elapsed):
            return None
        moved = (self._tracked.T_odom_camera
                 @ self._motion_model.predict(self._twist, elapsed).matrix)
        return se3.inverse(anchor.T_odom_camera) @ moved

    def _elapsed(self, prepared: PreparedFrame) -> float:
        """Return how long ago the camera was last tracked [s]."""
        return (prepared.stamp - self._tracked.prepared.stamp) / NANOSECONDS

    def _judge(self, registration: Registration, interval: float) -> tuple[Status, str]:
        """Return whether to believe a registration, and why not."""
        if not registration.status.ok:
            return registration.status, registration.reason
        count, fewest = registration.support, self._settings.min_matches
        if registration.evidence is Evidence.KEYPOINTS and count < fewest:
            return Status.TOO_FEW_MATCHES, f'{count} matches, odometry.min_matches is {fewest}'
        violation = self._motion_model.violation(
            Increment(PoseWithCovariance(registration.T_target_source), interval))
        if violation:
            return Status.MOTION_GATE, violation
        return Status.OK, registration.reason

    def _track(self, prepared: PreparedFrame, anchor: Anchor,
               registration: Registration) -> OdometryUpdate:
        recovered, self._is_lost = self._is_lost, False
        T_anchor_camera, covariance = registration.T_target_source, registration.covariance
        since, motion = anchor, (T_anchor_camera, covariance)
        if anchor is self._keyframe:
            since, motion = self._tracked, self._tracked.motion_to(T_anchor_camera, covariance)
        interval = (prepared.stamp - since.prepared.stamp) / NANOSECONDS
        self._twist = se3.log(motion[0]) / interval
        self._pose = anchor.T_odom_camera @ T_anchor_camera
        self._covariance = se3.compose_covariance(
            anchor.T_odom_camera, anchor.covariance, T_anchor_camera, covariance)
        self._remember(self._tracked)
        self._take_over(prepared, anchor, registration)
        return self._answer(
            prepared, Status.OK, registration.reason,
            increment=Increment(PoseWithCovariance(*motion), interval), recovered=recovered,
            reference=anchor.prepared.keypoints, matches=registration.matches,
            support=registration.support)

    def _take_over(self, prepared: PreparedFrame, anchor: Anchor,
                   registration: Registration) -> None:
        """Make a view the last tracked one, and choose what the next one is registered to."""
        self._lost = None
        if anchor is not self._keyframe:
            self._policy.begin()
        if self._policy.keeps(prepared, registration):
            self._keyframe = dataclasses.replace(
                anchor, prepared=self._reference.update(anchor.prepared, registration))
            self._tracked = Anchor(prepared, self._pose, self._covariance,
                                   registration.T_target_source, registration.covariance)
        else:
            carried = self._reference.propagate(anchor.prepared, prepared, registration)
            self._tracked = self._keyframe = Anchor(carried, self._pose, self._covariance)

    def _remember(self, anchor: Anchor) -> None:
        """Keep an anchor for frames that fail against the last one, one every while."""
        if self._earlier and (anchor.prepared.stamp - self._earlier[-1].prepared.stamp
                              < _EARLIER_APART * NANOSECONDS):
            return
        self._earlier.append(anchor)

    def _hold(self, prepared: PreparedFrame, status: Status, reason: str,
              predict: Predict) -> OdometryUpdate:
        self._is_lost = True
        anchor = self._tracked
        lost_for = (prepared.stamp - anchor.prepared.stamp) / NANOSECONDS
        predicted = predict(anchor.prepared.stamp, prepared.stamp)
        if predicted is None:
            motion = self._motion_model.predict(self._twist, lost_for)
        else:
            way = np.linalg.norm(predicted[:3, 3]), se3.angle(predicted[:3, :3])
            strayed = np.repeat(_SLIP * np.array(way) + _LEAST_SLIP, 3)
            motion = PoseWithCovariance(predicted, np.diag(strayed ** 2))
        self._pose = anchor.T_odom_camera @ motion.matrix
        self._covariance = se3.compose_covariance(
            anchor.T_odom_camera, anchor.covariance, motion.matrix, motion.covariance)
        if len(prepared.keypoints) >= self._settings.min_matches:
            self._lost = Anchor(prepared, self._pose, self._covariance)
        return self._answer(prepared, status, reason, predicted=predicted is not None)

    def _answer(self, prepared: PreparedFrame, status: Status, reason: str,
                **measured: Any) -> OdometryUpdate:
        return OdometryUpdate(prepared.stamp, status, reason,
                              PoseWithCovariance(self._pose, self._covariance), prepared,
                              **measured)
