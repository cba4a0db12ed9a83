# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How the camera is expected to move between frames."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.settings import OdometrySettings


class MotionModel:
    """
    Constant velocity with acceleration noise, within limits of speed and turn rate.

    A camera that nobody sees keeps its body velocity for ``hold_time`` and then stands still. A
    constant acceleration a moves it by a t^2 / 2 from there.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        self._hold_time = settings.hold_time
        self._max_speed = settings.max_speed
        self._max_turn_rate = settings.max_turn_rate
        self._acceleration_sigmas = np.repeat(
            [settings.acceleration_sigma, settings.angular_acceleration_sigma], 3)

    def holds(self, elapsed: float) -> bool:
        """Return whether the velocity still counts a time [s] after it was measured."""
        return elapsed <= self._hold_time

    def predict(self, twist: np.ndarray | None, elapsed: float) -> PoseWithCovariance:
        """
        Return the motion of the camera since its velocity was measured.

        :param twist: body velocity (vx, vy, vz, wx, wy, wz) [m/s, rad/s]; None: unknown, zero.
        :param elapsed: time since then [s].
        :returns: ``T_camera0_camera1``; its standard deviations are at most those of a camera
            that may be anywhere within the speed limit and turned in any direction.
        """
        velocity = np.zeros(6) if twist is None else twist
        sigmas = np.minimum(0.5 * self._acceleration_sigmas * elapsed ** 2,
                            np.repeat([self._max_speed * elapsed, np.pi], 3))
        return PoseWithCovariance(se3.exp(velocity * min(elapsed, self._hold_time)),
                                  np.diag(sigmas ** 2))

    def violation(self, increment: Increment) -> str | None:
        """Return how an increment exceeds the limits, in one sentence; None: it does not."""
        speed = np.linalg.norm(increment.pose.translation) / increment.interval
        turn_rate = se3.angle(increment.pose.rotation) / increment.interval
        if speed <= self._max_speed and turn_rate <= self._max_turn_rate:
            return None
        return (f'{speed:.2f} m/s and {turn_rate:.2f} rad/s, odometry.max_speed is '
                f'{self._max_speed:g} and odometry.max_turn_rate {self._max_turn_rate:g}')
