# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Motion of the camera that is expected between frames."""

from __future__ import annotations

import math

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import (
    Increment, PoseWithCovariance, along_all_axes, sums_along_and_about)
from aick_ros.settings import OdometrySettings

_HALF_TURN = math.pi  # by definition: no two orientations differ by more
_WITHIN_LIMITS = 3.0  # chosen: standard deviations of an unknown velocity up to its limits


class MotionModel:
    """
    Constant velocity with acceleration noise, within limits of speed and turn rate.

    An unobserved camera keeps its body velocity for ``hold_time`` and then stands still. A
    constant acceleration a adds a displacement of a t^2 / 2.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        self._hold_time = settings.hold_time
        self._max_speed, self._max_turn_rate = settings.max_speed, settings.max_turn_rate
        self._acceleration_sigma = settings.acceleration_sigma
        self._angular_acceleration_sigma = settings.angular_acceleration_sigma

    def holds(self, elapsed: float) -> bool:
        """Return whether the velocity is still used some time [s] after it was measured."""
        return elapsed <= self._hold_time

    def is_unlimited(self, elapsed: float) -> bool:
        """Return whether the camera may have turned in any direction in some time [s]."""
        return elapsed * self._max_turn_rate >= _HALF_TURN

    @property
    def unknown_speed(self) -> float:
        """Standard deviation of a velocity that was never measured, along an axis [m/s]."""
        return self._max_speed / _WITHIN_LIMITS

    def predict(self, twist: np.ndarray | None, elapsed: float) -> PoseWithCovariance:
        """
        Return the motion of the camera since its velocity was measured.

        :param twist: body velocity (vx, vy, vz, wx, wy, wz) [m/s, rad/s]; None: it was never
            measured, and may be any within the limits.
        :param elapsed: time since then [s].
        :returns: ``T_camera0_camera1``; its standard deviations are at most those of a camera
            that may be anywhere within the speed limit and turned in any direction.
        """
        velocity, share = (np.zeros(6), 1.0 / _WITHIN_LIMITS) if twist is None else (twist, 0.0)
        per_acceleration = 0.5 * elapsed ** 2
        farthest = elapsed * self._max_speed
        shift = min(math.hypot(per_acceleration * self._acceleration_sigma, share * farthest),
                    farthest)
        turn = min(math.hypot(per_acceleration * self._angular_acceleration_sigma,
                              share * elapsed * self._max_turn_rate), _HALF_TURN)
        return PoseWithCovariance(se3.exp(min(elapsed, self._hold_time) * velocity),
                                  along_all_axes(shift ** 2, turn ** 2))

    def change_of_twist(self, interval: float) -> np.ndarray:
        """
        Return the covariance of the velocity at the end of a motion about its mean, 6x6.

        After the hold time h an acceleration a changes the velocity by a (t - h) up to the end,
        and its mean by a (t - h)^2 / (2 t). The change is at most as large as the limits of speed.

        :param interval: time t of the motion [s].
        """
        changing = max(interval - self._hold_time, 0.0)
        per_acceleration = changing - 0.5 * changing ** 2 / interval
        speed = min(per_acceleration * self._acceleration_sigma, self._max_speed)
        turn_rate = min(per_acceleration * self._angular_acceleration_sigma, self._max_turn_rate)
        return along_all_axes(speed ** 2, turn_rate ** 2)

    def changes_unseen(self, increment: Increment) -> np.ndarray:
        """
        Return the squares of the change of the velocity before the first increment, 2.

        They are of translation and rotation [m^2/s^2, rad^2/s^2]. The change is that by an
        acceleration since the time of an increment, but no more than to the velocity from rest.
        """
        twist, elapsed = increment.twist, abs(increment.interval)
        limits = elapsed * math.sqrt(3) * np.array([  # of the lengths of three components
            self._acceleration_sigma, self._angular_acceleration_sigma])
        squares: np.ndarray = np.minimum(
            np.square(limits), sums_along_and_about(np.square(twist)))
        return squares

    def time_to_rest(self, twist: np.ndarray | None) -> float:
        """
        Return after which time [s] a camera whose images do not change has come to rest.

        :param twist: its velocity before; None: it was never measured, and may be any within the
            limits.
        """
        limits = np.repeat([self._max_speed, self._max_turn_rate], 3)
        velocity = limits / _WITHIN_LIMITS if twist is None else np.abs(twist)
        return self._hold_time + max(
            float(velocity[:3].max()) / self._acceleration_sigma,
            float(velocity[3:].max()) / self._angular_acceleration_sigma)

    def observed_twist(self, increment: Increment, unconfirmed: float) -> np.ndarray:
        """
        Return the velocity to predict with after an increment that depth alone measured.

        Where the scene has no shape the increment is the one that was predicted: past the hold
        time the camera stands still there, as if it were lost.

        :param unconfirmed: time since keypoints confirmed the velocity [s].
        """
        if self.holds(unconfirmed):
            return increment.twist
        prior = self.predict(np.zeros(6), unconfirmed).covariance
        # by the share of the information that is not the prior's
        kept: np.ndarray = prior @ np.linalg.solve(
            prior + increment.pose.covariance, increment.twist)
        return kept

    def violation(self, increment: Increment) -> str | None:
        """Return which limits an increment exceeds, with the numbers; None if it exceeds none."""
        speed = math.hypot(*increment.pose.translation) / increment.interval
        turn_rate = se3.angle(increment.pose.rotation) / increment.interval
        if speed <= self._max_speed and turn_rate <= self._max_turn_rate:
            return None
        return (f'{speed:.2f} m/s and {turn_rate:.2f} rad/s, odometry.max_speed is '
                f'{self._max_speed:g} and odometry.max_turn_rate {self._max_turn_rate:g}')
