# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The motion that is expected of the camera, with its covariance, whoever expects it.

It is that of the motion model, or of another odometry, with a term for each sensor that measures
a part of it. Registrations begin there, frames without images continue there, and what the images
show is fused with the same terms.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.inertial.accelerometer import Accelerometer
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.motion_term import MotionTerm
from aick_ros.odometry.other_odometry import OtherOdometry
from aick_ros.registration.result import Registration
from aick_ros.settings import OdometrySettings

_AT_REST = PoseWithCovariance.identity()
_SMALLEST_MOTION = 0.03  # m, rad; chosen: three times the smallest noise of other odometry


class ExpectedMotion:
    """
    Expects motions between stamps.

    :param settings: of the motion model.
    :param gyroscope: with the samples of an IMU, if there are any.
    :param other: another odometry, if there is one.
    :param accelerometer: likewise.
    """

    def __init__(self, settings: OdometrySettings, gyroscope: Gyroscope, other: OtherOdometry,
                 accelerometer: Accelerometer) -> None:
        self._motion_model = MotionModel(settings)
        self._gyroscope, self._other, self._accelerometer = gyroscope, other, accelerometer

    def is_known(self, start: int, end: int, twist: np.ndarray | None) -> bool:
        """
        Return whether more is known of the motion between two stamps [ns] than its limits.

        :param twist: body velocity of the camera at the start; None: unknown.
        """
        holds = twist is not None and self._motion_model.holds(seconds(start, end))
        return holds or any(True for _ in self._terms(start, end))

    def is_measured(self, start: int, end: int, twist: np.ndarray | None) -> bool:
        """
        Return whether another sensor has measured the motion of a camera that is not seen.

        Parameters are as for :meth:`without_images`.
        """
        onwards = self._wheels_from(start, end)
        if self._other.motion(start, end) is not None or onwards is not None:
            return True
        return self._accelerometer.knows(start, end) and self._agreed(
            self._without_displacement(start, end, twist), start, end) is not None

    def is_moving(self, start: int, end: int) -> bool:
        """
        Return whether an IMU has measured a motion between two stamps [ns].

        It is more than its noise, of which a simulated one may have more than is known.
        """
        for term in (self._gyroscope.term(start, end), self._accelerometer.term(start, end)):
            fusion = None if term is None else term.added_to(_AT_REST)
            if (fusion is not None and not fusion.is_of_noise
                    and np.linalg.norm(fusion.error) > _SMALLEST_MOTION):
                return True
        return False

    def between(self, start: int, end: int, twist: np.ndarray | None) -> PoseWithCovariance:
        """
        Return the motion ``T_camera0_camera1`` between two stamps [ns].

        :param twist: body velocity of the camera at the start; None: unknown.
        """
        if twist is None or not self._motion_model.holds(seconds(start, end)):
            return self.without_images(start, end, twist)
        motion = self._motion_model.predict(twist, seconds(start, end))
        motion = self._with_terms(motion, start, end)
        return self._agreed(motion, start, end) or motion

    def steady(self, start: int, end: int, twist: np.ndarray | None) -> PoseWithCovariance | None:
        """Return the motion at constant velocity; None: unknown, or what is expected anyway."""
        if twist is None or not self._motion_model.holds(seconds(start, end)) or not any(
                True for _ in self._terms(start, end)):
            return None
        return self._motion_model.predict(twist, seconds(start, end))

    def without_images(self, start: int, end: int, twist: np.ndarray | None
                       ) -> PoseWithCovariance:
        """
        Return the motion of a camera that is not seen: by another odometry, if there is one.

        Where that contradicts an IMU, which the camera has confirmed, wheels slip: the rotation is
        the gyroscope's, and the translation, as long as it is known, that of the accelerometer.
        From there the wheels go on. They do not count before, as what they slipped by stays.
        """
        onwards = self._wheels_from(start, end)
        if onwards is not None:
            known, by_wheels = onwards
            return self._turned(self.without_images(start, known, twist)
                                @ self._other.with_slip(by_wheels), start, end)
        motion = self._without_displacement(start, end, twist)
        agreed = self._agreed(motion, start, end)
        if agreed is None and self._accelerometer.knows(start, end):
            agreed = self._agreed(self._by_model(start, end, twist), start, end)
            if agreed is not None:
                self._other.slipped_since = start
        return agreed or motion

    def _wheels_from(self, start: int, end: int) -> tuple[int, np.ndarray] | None:
        """Return up to where a displacement is known [ns], and the motion by wheels from there."""
        known = self._accelerometer.known_until(start, end)
        motion = self._other.motion(known, end) if start < known < end else None
        return None if motion is None else (known, motion)

    def _without_displacement(self, start: int, end: int, twist: np.ndarray | None
                              ) -> PoseWithCovariance:
        """Return the motion of a camera that is not seen, without the accelerometer."""
        by_other = self._other.motion(start, end)
        if by_other is None or start == self._other.slipped_since:
            return self._by_model(start, end, twist)
        return self._turned(self._other.with_slip(by_other), start, end)

    def _by_model(self, start: int, end: int, twist: np.ndarray | None) -> PoseWithCovariance:
        """Return the motion of the motion model, turned by the gyroscope."""
        return self._turned(self._motion_model.predict(twist, seconds(start, end)), start, end)

    def _turned(self, motion: PoseWithCovariance, start: int, end: int) -> PoseWithCovariance:
        """Return a motion with the rotation by the gyroscope, whether it agrees or not."""
        term = self._gyroscope.term(start, end)
        return motion if term is None else term.added_to(motion).pose

    def twist_at(self, stamp: int, twist: np.ndarray) -> np.ndarray:
        """Return a body velocity with the turn rate at a stamp [ns], where that is measured."""
        rate = self._gyroscope.rate_at(stamp)
        return twist if rate is None else np.concatenate([twist[:3], rate])

    def fused(self, seen: Registration, start: int, end: int) -> Registration:
        """Return the registration of a frame to a keyframe, by their stamps [ns], with terms."""
        if not seen.status.ok or seen.is_by_depth:
            return seen  # the latter was registered with the expected motion as a term
        for term in self._terms(start, end, is_summed=True):
            fusion = term.added_to(seen.pose)
            if not fusion.is_of_noise:
                continue
            fused, kept = fusion.pose, fusion.update.kept
            seen = replaced(
                seen, T_target_source=fused.matrix, covariance=fused.covariance,
                systematic=kept @ seen.systematic @ kept.T, unusual=kept @ seen.unusual @ kept.T,
                timing=kept @ seen.timing @ kept.T)
        return seen

    def with_alternative(self, found: Registration, start: int, end: int,
                         twist: np.ndarray) -> Registration:
        """
        Return a registration to a frame that was lost, as it may show no scene but an object.

        :param twist: body velocity before the loss [m/s, rad/s]. While it holds, all that the
            motion differs by from the one expected may be an error.
        """
        if not found.status.ok or not self._motion_model.holds(seconds(start, end)):
            return found
        alternative = self.alternative_covariance(found.T_target_source, start, end, twist)
        return replaced(found, covariance=found.covariance + alternative,
                        unusual=found.unusual + alternative)

    def alternative_covariance(self, motion: np.ndarray, start: int, end: int,
                               twist: np.ndarray) -> np.ndarray:
        """Return the covariance by which a motion, 4x4, may be the one expected instead, 6x6."""
        off = se3.difference(motion, self.between(start, end, twist).matrix)
        return np.outer(off, off)

    def fused_increment(self, seen: Increment, start: int, end: int) -> Increment:
        """Return an increment between two stamps [ns], as the camera saw it, with the terms."""
        fused = self._with_terms(seen.pose, start, end)
        return seen if fused is seen.pose else Increment(fused, seen.interval)

    def _with_terms(self, motion: PoseWithCovariance, start: int, end: int) -> PoseWithCovariance:
        """Return a motion between two stamps [ns] with the terms that agree with it."""
        for term in self._terms(start, end):
            fusion = term.added_to(motion)
            if fusion.is_of_noise:
                motion = fusion.pose
        return motion

    def _agreed(self, motion: PoseWithCovariance, start: int,
                end: int) -> PoseWithCovariance | None:
        """
        Return a motion between two stamps [ns] with that by the accelerometer.

        None where that does not agree, or is not known. What is not known up to the end is
        left to wheels that have not slipped.
        """
        if (self._other.motion(start, end) is not None and start != self._other.slipped_since
                and not self._accelerometer.knows(start, end)):
            return None
        term = self._accelerometer.term(start, end)
        fusion = None if term is None else term.added_to(motion)
        return None if fusion is None or not fusion.is_of_noise else fusion.pose

    def _terms(self, start: int, end: int, is_summed: bool = False) -> Iterator[MotionTerm]:
        if end > start:
            for sensor in (self._gyroscope, self._other):
                term = sensor.term(start, end, is_summed)
                if term is not None:
                    yield term
