# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The displacement of a camera that is not seen, by its accelerometer and its gyroscope.

The gravity filter knows velocity, gravity and bias at the last frame that was measured. From there
its equations go on without measurements, with the rotation by the gyroscope.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS, seconds
from aick_ros.odometry.inertial.force_integral import ForceIntegral
from aick_ros.odometry.inertial.gravity_filter import GravityFilter
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.motion_term import POSITION, MotionTerm

_STEP = NANOSECONDS // 25  # chosen: a hand turns evenly meanwhile

_LARGEST_SIGMA = 0.3
"""Standard deviation of a displacement along an axis from which on it is not followed [m].

Chosen: on three rendered rooms a BMI055 gets there in four seconds, and errs by a third of it. It
errs with the square of the time: a covered camera would leave the room in half a minute."""

_NO_COVARIANCE = np.zeros((3, 3))  # by definition: of the rotation, which is added at the end


@dataclass(frozen=True, eq=False)
class LastMeasured:
    """
    The last frame whose pose was measured.

    :param stamp: of it [ns].
    :param estimate: velocity, gravity, bias and lever arm there; it is changed, in place.
    :param pose: of the accelerometer there, in the axes of the estimate.
    :param offset: time to add to the stamps of images to get those of the forces [ns].
    :param position: of the accelerometer in the camera as it is known beforehand, 3 [m].
    """

    stamp: int
    estimate: GravityFilter
    pose: PoseWithCovariance
    offset: int
    position: np.ndarray


class Displacement:
    """
    Follows a camera from the last frame whose pose was measured, as long as it is known where.

    After that the displacement stays, and the camera may move at any speed within its limits.

    :param last: that frame.
    :param forces: of the accelerometer.
    :param gyroscope: rotation since then.
    :param speed_sigma: standard deviation of a velocity that is not known, along an axis [m/s].
    :param factor: variance of a displacement, as a ratio to what the filter says.
    """

    def __init__(self, last: LastMeasured, forces: ForceIntegral, gyroscope: Gyroscope,
                 speed_sigma: float, factor: float = 1.0) -> None:
        self._last, self._forces, self._gyroscope = last, forces, gyroscope
        self._speed_sigma, self._factor = speed_sigma, factor
        self._estimate = last.estimate
        self._estimate.set_origin()
        self._stamp, self._rotation = last.stamp, last.pose.rotation
        self._final: tuple[int, MotionTerm] | None = None  # the last one followed, and its stamp

    @property
    def is_followed(self) -> bool:
        """Certainty of the last displacement that was asked for, as far as it was measured."""
        return self._final is None

    def term(self, end: int) -> MotionTerm | None:
        """
        Return the displacement up to a stamp [ns] as a measurement; None: it is not known.

        Stamps do not go back.
        """
        if self._final is not None:
            return self._unseen_since(*self._final, end)
        turn = self._gyroscope.term(self._last.stamp, end)
        if turn is None or not self._goes_on(end):
            return None
        term = self._measured(turn, end)
        if np.linalg.eigvalsh(term.covariance)[-1] > _LARGEST_SIGMA ** 2:
            self._final = end, term
        return term

    def _unseen_since(self, stamp: int, term: MotionTerm, end: int) -> MotionTerm:
        """Return the displacement up to a stamp [ns] of a camera that moves on as it may."""
        moved = self._speed_sigma * seconds(stamp, end)
        return dataclasses.replace(term, covariance=term.covariance + moved ** 2 * np.eye(3))

    def _measured(self, turn: MotionTerm, end: int) -> MotionTerm:
        """Return the displacement up to a stamp [ns], with the rotation up to there."""
        first = self._last.pose
        arm, to_camera = self._rotation - first.rotation, first.rotation.T
        shift, covariance = self._estimate.displacement(arm)
        motion = np.eye(4)
        motion[:3, :3] = turn.T_target_source[:3, :3]
        motion[:3, 3] = to_camera @ (shift - arm @ self._last.position)
        return MotionTerm(motion, POSITION, self._factor * to_camera @ (
            covariance + self._by_tilt(turn.covariance, seconds(self._last.stamp, end))
        ) @ to_camera.T)

    def _by_tilt(self, turned: np.ndarray, elapsed: float) -> np.ndarray:
        """
        Return the covariance of a displacement by gravity that is taken for another force, 3x3.

        :param turned: 3x3, that of the rotation since the last frame, in the axes of that camera.
            It grows meanwhile: as if it were all there from the start it is rather too large.
        :param elapsed: time since then [s].
        """
        axes = self._last.pose.rotation
        orientation = self._last.pose.covariance[3:, 3:] + axes @ turned @ axes.T
        arm = 0.5 * elapsed ** 2 * se3.skew(self._estimate.gravity)
        covariance: np.ndarray = arm @ orientation @ arm.T
        return covariance

    def _goes_on(self, end: int) -> bool:
        """Go on to a stamp [ns]; return whether samples have arrived up to there."""
        offset = self._last.offset
        while self._stamp < end:
            stamp = min(end, self._stamp + _STEP)
            turned = self._gyroscope.rotation(self._last.stamp, stamp)
            if turned is None:
                return False
            rotation = self._last.pose.rotation @ turned
            impulse = self._forces.between(self._stamp + offset, stamp + offset, self._rotation,
                                           rotation)
            if impulse is None:
                return False
            self._estimate.predict(impulse, _NO_COVARIANCE)
            self._stamp, self._rotation = stamp, rotation
        return self._stamp == end
