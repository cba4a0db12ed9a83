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

from aick_ros.geometry import definite, se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.inertial.followed import STEP, Followed
from aick_ros.odometry.inertial.force_integral import ForceIntegral
from aick_ros.odometry.inertial.gravity_filter import GravityFilter
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.motion_term import POSITION, MotionTerm

_NO_COVARIANCE = np.zeros((3, 3))  # by definition: of the rotation, which is added at the end


@dataclass(frozen=True, eq=False)
class LastMeasured:
    """
    The last frame whose pose was measured.

    :param stamp: of it [ns].
    :param estimate: velocity, gravity, bias and lever arm there.
    :param pose: of the accelerometer there, in the axes of the estimate.
    :param offset: time to add to the stamps of images to get those of the forces [ns].
    :param position: of the accelerometer in the camera as it is known beforehand, 3 [m].
    """

    stamp: int
    estimate: GravityFilter
    pose: PoseWithCovariance
    offset: int
    position: np.ndarray


@dataclass(frozen=True)
class Limits:
    """
    How far a camera is followed, and what it may do after that.

    :param position_sigma: standard deviation of its position along an axis, up to which it is [m].
    :param speed_sigma: that of a velocity that is not known [m/s].
    """

    position_sigma: float
    speed_sigma: float


class Displacement:
    """
    Follows a camera from the last frame whose pose was measured, as long as it is known where.

    After that, and where samples are missing, the displacement stays as it was, and the camera may
    move on within its limits.

    :param last: that frame.
    :param forces: of the accelerometer.
    :param gyroscope: rotation since then.
    :param factor: variance of a displacement, as a ratio to what the filter says.
    """

    def __init__(self, last: LastMeasured, forces: ForceIntegral, gyroscope: Gyroscope,
                 limits: Limits, factor: float = 1.0) -> None:
        self._last, self._forces, self._gyroscope = last, forces, gyroscope
        self._limits, self._factor = limits, factor
        self._reached = Followed(last.stamp, last.estimate.from_origin(), last.pose.rotation)
        self._known: tuple[int, MotionTerm] | None = None  # the last stamp and displacement
        self._is_followed = True

    @property
    def reached(self) -> int:
        """Stamp up to which the camera was followed [ns]."""
        return self._last.stamp if self._known is None else self._known[0]

    @property
    def is_followed(self) -> bool:
        """Measurement of the last displacement that was asked for, up to its end."""
        return self._is_followed

    def term(self, end: int) -> MotionTerm | None:
        """
        Return the displacement up to a stamp [ns] as a measurement; None: it is not known.

        Stamps do not go back, but to :attr:`reached`.
        """
        if self._known is not None and end == self._known[0]:
            self._is_followed = True
            return self._known[1]
        is_certain = self._known is None or (
            definite.largest_sigma(self._known[1].covariance) <= self._limits.position_sigma)
        term = self._measured(end) if is_certain else None
        self._is_followed = term is not None
        if term is not None:
            self._known = end, term
        return None if self._known is None else self._unseen_since(*self._known, end)

    def _unseen_since(self, stamp: int, term: MotionTerm, end: int) -> MotionTerm:
        """Return the displacement up to a stamp [ns] of a camera that moves on as it may."""
        moved = self._limits.speed_sigma * seconds(stamp, end)
        return dataclasses.replace(term, covariance=term.covariance + moved ** 2 * np.eye(3))

    def _measured(self, end: int) -> MotionTerm | None:
        """Return the displacement up to a stamp [ns] by the samples; None: some are missing."""
        turn, reached = self._gyroscope.term(self._last.stamp, end), self._at(end)
        if turn is None or reached is None:
            return None
        first = self._last.pose
        arm, to_camera = reached.rotation - first.rotation, first.rotation.T
        shift, covariance = reached.estimate.displacement(arm)
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
        arm = 0.5 * elapsed ** 2 * se3.skew(self._reached.estimate.gravity)
        covariance: np.ndarray = arm @ orientation @ arm.T
        return covariance

    def _at(self, end: int) -> Followed | None:
        """
        Return where the camera is at a stamp [ns]; None where samples are missing.

        Steps are kept up to the last sample: later ones are made again once theirs have arrived.
        """
        last = self._forces.last
        arrived = end if last is None else min(end, last - self._last.offset)
        reached: Followed | None = self._reached
        while reached is not None and reached.stamp < end:
            reached = self._stepped(reached, end if reached.stamp >= arrived else arrived)
            if reached is not None and reached.stamp <= arrived:
                self._reached = reached
        return None if reached is None or reached.stamp != end else reached

    def _stepped(self, reached: Followed, end: int) -> Followed | None:
        """Return where the camera is a step later, or at a stamp [ns] before that."""
        stamp = min(end, reached.stamp + STEP)
        turned = self._gyroscope.rotation(self._last.stamp, stamp)
        if turned is None:
            return None
        return reached.moved(stamp, self._last.pose.rotation @ turned, self._forces,
                             self._last.offset, _NO_COVARIANCE)
