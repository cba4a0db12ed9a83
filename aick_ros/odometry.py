# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Camera motion from a stream of RGB-D frames."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from aick_ros import rigid
from aick_ros.aick import Aick, Registration
from aick_ros.frame import KeypointExtractor, KeypointFrame, RgbdFrame
from aick_ros.settings import OdometrySettings, Settings
from aick_ros.status import Status
from aick_ros.synchronizer import RESTART_AFTER
from aick_ros.trajectory import NANOSECONDS
from aick_ros.vocabulary import vocabulary_of

_HELD_ACCELERATION = np.array([3.0, 3.0, 3.0, 15.0, 15.0, 15.0])
"""What a hand may do against constant velocity [m/s^2, rad/s^2]: how sure a held pose is."""


@dataclass(frozen=True, eq=False)
class OdometryUpdate:
    """
    What one frame told.

    :param stamp: of the frame [ns].
    :param status: OK or FIRST_FRAME, or why the pose is a guess; ``reason`` has the numbers.
    :param T_odom_camera: 4x4 float64 [m]; held at constant velocity where the frame was lost.
    :param covariance: 6x6 of the pose, accumulated since the start [m^2, m rad, rad^2].
    :param keypoints: of this frame.
    :param increment: 4x4, from the frame it was registered to; the identity where there is none.
    :param increment_covariance: 6x6; infinite on the diagonal where there is no increment.
    :param interval: time of the increment [s]; 0 where there is none.
    :param recovered: whether this is the first tracked frame after lost ones, or of a recording
        that started again.
    :param matches: Kx2, rows (keypoint, keypoint of the reference).
    :param timing: milliseconds of the stages: ``features``, ``registration``, ``total``.
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
    recovered: bool = False
    matches: np.ndarray = field(default_factory=lambda: np.empty((0, 2), np.intp))
    timing: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class _Anchor:
    """A frame with a pose, which others can be registered to."""

    keypoints: KeypointFrame
    T_odom_camera: np.ndarray
    covariance: np.ndarray


class Odometry:
    """
    Frame-to-frame odometry.

    A frame is registered to the last tracked one. Where that fails its pose is held at constant
    velocity, and the next frame is tried against the last tracked frame first, then against the
    lost one before it: so one bad pair is bridged, and after a long loss the pose goes on from
    where it was held, without a jump.

    :param T_odom_camera: pose of the first frame; None: the identity.
    """

    def __init__(self, settings: Settings = Settings(),
                 T_odom_camera: np.ndarray | None = None) -> None:
        self._settings: OdometrySettings = settings.odometry
        self._extractor = KeypointExtractor(settings.features, settings.sensor,
                                            vocabulary_of(settings), settings.aick.word_radius)
        self._aick = Aick(settings.aick)
        self.reset(T_odom_camera)

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
        start = time.perf_counter()
        keypoints = self._extractor.extract(frame)
        extracted = time.perf_counter()
        update = self._register(keypoints)
        end = time.perf_counter()
        return dataclasses.replace(update, timing={
            'features': 1e3 * (extracted - start), 'registration': 1e3 * (end - extracted),
            'total': 1e3 * (end - start)})

    def _forget(self, pose: np.ndarray, covariance: np.ndarray, is_lost: bool = False) -> None:
        self._pose, self._covariance = pose, covariance
        self._twist = np.zeros(6)
        self._stamp: int | None = None
        self._tracked: _Anchor | None = None
        self._lost: _Anchor | None = None
        self._is_lost = is_lost

    def _register(self, keypoints: KeypointFrame) -> OdometryUpdate:
        if self._stamp is not None and keypoints.stamp <= self._stamp:
            back = self._stamp - keypoints.stamp
            if back <= RESTART_AFTER:
                return self._answer(keypoints, Status.BAD_STAMP,
                                    f'{back / NANOSECONDS:.6f} s before the last frame')
            self._forget(self._pose, self._covariance, is_lost=True)
        self._stamp = keypoints.stamp
        if self._tracked is None:
            return self._start(keypoints)
        failure = None
        for anchor in self._anchors():
            registration = self._aick.register(keypoints, anchor.keypoints)
            interval = (keypoints.stamp - anchor.keypoints.stamp) / NANOSECONDS
            status, reason = self._judge(registration, interval)
            if status.ok:
                return self._track(keypoints, anchor, registration, interval)
            failure = failure or (status, reason)
        return self._hold(keypoints, *failure)

    def _start(self, keypoints: KeypointFrame) -> OdometryUpdate:
        fewest = self._settings.min_matches
        if len(keypoints) < fewest:
            return self._answer(keypoints, Status.TOO_FEW_KEYPOINTS,
                                f'{len(keypoints)} keypoints with depth, it takes {fewest}')
        recovered, self._is_lost = self._is_lost, False
        self._tracked = _Anchor(keypoints, self._pose, self._covariance)
        return self._answer(keypoints, Status.FIRST_FRAME, f'{len(keypoints)} keypoints',
                            recovered=recovered)

    def _anchors(self) -> Iterator[_Anchor]:
        yield self._tracked
        if self._lost is not None:
            yield self._lost

    def _judge(self, registration: Registration, interval: float) -> tuple[Status, str]:
        """Return whether to believe a registration, and why not."""
        if not registration.status.ok:
            return registration.status, registration.reason
        count, fewest = len(registration.matches), self._settings.min_matches
        if count < fewest:
            return Status.TOO_FEW_MATCHES, f'{count} matches, odometry.min_matches is {fewest}'
        speed = np.linalg.norm(registration.T_target_source[:3, 3]) / interval
        turn_rate = rigid.angle(registration.T_target_source[:3, :3]) / interval
        if speed > self._settings.max_speed or turn_rate > self._settings.max_turn_rate:
            return Status.MOTION_GATE, (
                f'{speed:.2f} m/s and {turn_rate:.2f} rad/s, odometry.max_speed is '
                f'{self._settings.max_speed:g} and odometry.max_turn_rate '
                f'{self._settings.max_turn_rate:g}')
        return Status.OK, registration.reason

    def _track(self, keypoints: KeypointFrame, anchor: _Anchor, registration: Registration,
               interval: float) -> OdometryUpdate:
        recovered, self._is_lost, self._lost = self._is_lost, False, None
        increment = registration.T_target_source
        self._covariance = rigid.compose_covariance(
            anchor.T_odom_camera, anchor.covariance, increment, registration.covariance)
        self._pose = anchor.T_odom_camera @ increment
        self._twist = rigid.log(increment) / interval
        self._tracked = _Anchor(keypoints, self._pose, self._covariance)
        return self._answer(
            keypoints, Status.OK, registration.reason, increment=increment,
            increment_covariance=registration.covariance, interval=interval, recovered=recovered,
            matches=registration.matches)

    def _hold(self, keypoints: KeypointFrame, status: Status, reason: str) -> OdometryUpdate:
        self._is_lost = True
        anchor = self._tracked
        lost_for = (keypoints.stamp - anchor.keypoints.stamp) / NANOSECONDS
        motion = rigid.exp(self._twist * min(lost_for, self._settings.hold_time))
        self._pose = anchor.T_odom_camera @ motion
        strayed = np.minimum(0.5 * _HELD_ACCELERATION * lost_for ** 2,
                             np.repeat([self._settings.max_speed * lost_for, np.pi], 3))
        self._covariance = rigid.compose_covariance(
            anchor.T_odom_camera, anchor.covariance, motion, np.diag(strayed ** 2))
        if len(keypoints) >= self._settings.min_matches:
            self._lost = _Anchor(keypoints, self._pose, self._covariance)
        return self._answer(keypoints, status, reason)

    def _answer(self, keypoints: KeypointFrame, status: Status, reason: str,
                **measured: Any) -> OdometryUpdate:
        return OdometryUpdate(keypoints.stamp, status, reason, self._pose, self._covariance,
                              keypoints, **measured)
