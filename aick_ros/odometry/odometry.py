# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Camera motion from a stream of RGB-D frames."""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from aick_ros.features.detector import Detector
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS, RESTART_AFTER
from aick_ros.odometry.keyframe import Anchor, KeyframePolicy, OneFrame
from aick_ros.odometry.local_map import LocalMap
from aick_ros.odometry.motion_model import MotionModel
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


@dataclass(frozen=True, eq=False)
class OdometryUpdate:
    """
    What one frame told.

    :param stamp: of the frame [ns].
    :param status: OK or FIRST_FRAME, or why the pose is a guess; ``reason`` has the numbers.
    :param T_odom_camera: 4x4 float64 [m]; held at constant velocity where the frame was lost.
    :param covariance: 6x6 of the pose, accumulated since the start [m^2, m rad, rad^2].
    :param keypoints: of this frame.
    :param increment: 4x4, from the frame ``interval`` earlier, the last tracked one or, after a
        loss, one before; the identity where there is none.
    :param increment_covariance: 6x6; infinite on the diagonal where there is no increment.
    :param interval: time of the increment [s]; 0 where there is none.
    :param refused: 4x4, the increment from the frame ``refused_interval`` earlier [s] that was
        found but not believed; None where there is none.
    :param recovered: whether this is the first tracked frame after lost ones, or of a recording
        that started again.
    :param predicted: whether the pose of a lost frame is that of the motion predicted.
    :param reference: the keypoints it was registered to; None where there is no increment.
    :param matches: Kx2, rows (keypoint, keypoint of the reference).
    :param support: keypoints that agree with the increment; 0 where there is none.
    :param view: the frame, ready to be registered.
    :param timing: milliseconds of each of :data:`aick_ros.registration.stage_times.STAGES`, and ``total``.
    """

    stamp: int
    status: Status
    reason: str
    T_odom_camera: np.ndarray
    covariance: np.ndarray
    keypoints: KeypointFrame
    increment: np.ndarray = field(default_factory=lambda: np.eye(4))
    increment_covariance: np.ndarray = field(default_factory=lambda: np.diag([np.inf] * 6))
    interval: float = 0.0
    refused: np.ndarray | None = None
    refused_interval: float = 0.0
    recovered: bool = False
    predicted: bool = False
    reference: KeypointFrame | None = None
    matches: np.ndarray = field(default_factory=lambda: np.empty((0, 2), np.intp))
    support: int = 0
    view: PreparedFrame | None = None
    timing: dict[str, float] = field(default_factory=dict)


class Odometry:
    """
    Odometry by registering each frame to the keyframe, or to the last tracked frame.

    Where both fail the frame is tried against earlier ones, then its pose is the one predicted,
    or held at constant velocity, and the next frame is tried against the lost one, too: so one
    bad pair is bridged, a camera that was covered finds back to where it was, and after a long
    loss the pose goes on from where it was held.

    :param T_odom_camera: pose of the first frame; None: the identity.
    :param predict: the motion between two stamps by another sensor, asked where a frame is lost.
    :param detector: used instead of the one that ``features.detector`` names.
    """

    def __init__(self, settings: Settings = Settings(), T_odom_camera: np.ndarray | None = None,
                 predict: Predict = lambda before, now: None,
                 detector: Detector | None = None) -> None:
        self._predict = predict
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

    def register_frame(self, frame: RgbdFrame) -> OdometryUpdate:
        """
        Return where the camera was at a frame.

        A stamp that repeats or goes back a little is answered with BAD_STAMP and changes nothing;
        one that goes back by more than a second starts a new recording at the pose reached.
        """
        self._times.take()
        update = self._register(self._registrar.prepare(frame))
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

    def _register(self, view: PreparedFrame) -> OdometryUpdate:
        if self._stamp is not None and view.stamp <= self._stamp:
            back = self._stamp - view.stamp
            if back <= RESTART_AFTER:
                return self._answer(view, Status.BAD_STAMP,
                                    f'{back / NANOSECONDS:.6f} s before the last frame')
            self._forget(self._pose, self._covariance, is_lost=True)
        self._stamp = view.stamp
        if self._tracked is None:
            return self._start(view)
        failure = None
        for anchor in self._anchors():
            interval = (view.stamp - anchor.view.stamp) / NANOSECONDS
            registration = self._reference.register(
                self._registrar, view, anchor.view, self._expected(view, anchor),
                self._elapsed(view))
            status, reason = self._judge(registration, interval)
            if status.ok:
                return self._track(view, anchor, registration)
            failure = failure or (status, reason, registration, interval)
        status, reason, refused, interval = failure
        held = self._hold(view, status, reason)
        if not refused.status.ok:
            return held
        return dataclasses.replace(held, refused=refused.T_target_source,
                                   refused_interval=interval)

    def _start(self, view: PreparedFrame) -> OdometryUpdate:
        fewest = self._settings.min_matches
        if len(view.keypoints) < fewest:
            return self._answer(view, Status.TOO_FEW_KEYPOINTS,
                                f'{len(view.keypoints)} keypoints with depth, it takes {fewest}')
        recovered, self._is_lost = self._is_lost, False
        self._tracked = self._keyframe = Anchor(self._reference.start(view), self._pose,
                                                self._covariance)
        return self._answer(view, Status.FIRST_FRAME, f'{len(view.keypoints)} keypoints',
                            recovered=recovered)

    def _anchors(self) -> Iterator[Anchor]:
        """Yield what a frame is tried against, until one holds."""
        yield self._keyframe
        if self._tracked is not self._keyframe:
            yield self._tracked
        yield from reversed(self._earlier)
        if self._lost is not None:
            yield self._lost

    def _expected(self, view: PreparedFrame, anchor: Anchor) -> np.ndarray | None:
        """Return where the view is seen from an anchor at constant velocity, 4x4."""
        elapsed = self._elapsed(view)
        if self._twist is None or not self._motion_model.holds(elapsed):
            return None
        moved = (self._tracked.T_odom_camera
                 @ self._motion_model.predict(self._twist, elapsed).matrix)
        return se3.inverse(anchor.T_odom_camera) @ moved

    def _elapsed(self, view: PreparedFrame) -> float:
        """Return how long ago the camera was last tracked [s]."""
        return (view.stamp - self._tracked.view.stamp) / NANOSECONDS

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

    def _track(self, view: PreparedFrame, anchor: Anchor, registration: Registration) -> OdometryUpdate:
        recovered, self._is_lost = self._is_lost, False
        T_anchor_camera, covariance = registration.T_target_source, registration.covariance
        since, motion = anchor, (T_anchor_camera, covariance)
        if anchor is self._keyframe:
            since, motion = self._tracked, self._tracked.motion_to(T_anchor_camera, covariance)
        interval = (view.stamp - since.view.stamp) / NANOSECONDS
        self._twist = se3.log(motion[0]) / interval
        self._pose = anchor.T_odom_camera @ T_anchor_camera
        self._covariance = se3.compose_covariance(
            anchor.T_odom_camera, anchor.covariance, T_anchor_camera, covariance)
        self._remember(self._tracked)
        self._take_over(view, anchor, registration)
        return self._answer(
            view, Status.OK, registration.reason, increment=motion[0],
            increment_covariance=motion[1], interval=interval, recovered=recovered,
            reference=anchor.view.keypoints, matches=registration.matches,
            support=registration.support)

    def _take_over(self, view: PreparedFrame, anchor: Anchor, registration: Registration) -> None:
        """Make a view the last tracked one, and choose what the next one is registered to."""
        self._lost = None
        if anchor is not self._keyframe:
            self._policy.begin()
        if self._policy.keeps(view, registration):
            self._keyframe = dataclasses.replace(
                anchor, view=self._reference.update(anchor.view, registration))
            self._tracked = Anchor(view, self._pose, self._covariance,
                                   registration.T_target_source, registration.covariance)
        else:
            carried = self._reference.propagate(anchor.view, view, registration)
            self._tracked = self._keyframe = Anchor(carried, self._pose, self._covariance)

    def _remember(self, anchor: Anchor) -> None:
        """Keep an anchor for frames that fail against the last one, one every while."""
        if self._earlier and (anchor.view.stamp - self._earlier[-1].view.stamp
                              < _EARLIER_APART * NANOSECONDS):
            return
        self._earlier.append(anchor)

    def _hold(self, view: PreparedFrame, status: Status, reason: str) -> OdometryUpdate:
        self._is_lost = True
        anchor = self._tracked
        lost_for = (view.stamp - anchor.view.stamp) / NANOSECONDS
        predicted = self._predict(anchor.view.stamp, view.stamp)
        if predicted is None:
            motion = self._motion_model.predict(self._twist, lost_for)
        else:
            way = np.linalg.norm(predicted[:3, 3]), se3.angle(predicted[:3, :3])
            strayed = np.repeat(_SLIP * np.array(way) + _LEAST_SLIP, 3)
            motion = PoseWithCovariance(predicted, np.diag(strayed ** 2))
        self._pose = anchor.T_odom_camera @ motion.matrix
        self._covariance = se3.compose_covariance(
            anchor.T_odom_camera, anchor.covariance, motion.matrix, motion.covariance)
        if len(view.keypoints) >= self._settings.min_matches:
            self._lost = Anchor(view, self._pose, self._covariance)
        return self._answer(view, status, reason, predicted=predicted is not None)

    def _answer(self, view: PreparedFrame, status: Status, reason: str, **measured: Any) -> OdometryUpdate:
        return OdometryUpdate(view.stamp, status, reason, self._pose, self._covariance,
                              view.keypoints, view=view, **measured)
