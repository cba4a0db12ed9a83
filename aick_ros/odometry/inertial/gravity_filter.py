# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Gravity and the bias of an accelerometer, by a Kalman filter on the positions of the camera.

The camera measures orientations R and positions c. With them the specific force a, of bias b,
gives velocity v and position p of the accelerometer by

    v1 = v0 + (integral of R (a - b)) - g t
    p1 = p0 + v0 t + (double integral of R (a - b)) - g t^2 / 2
    c1 = p1 - R1 l

so that positions separate gravity g (which points up here) from acceleration. The lever arm l is
estimated where the position of the accelerometer is not known: where a camera turns, what is
beside it is accelerated otherwise. So is the time offset of the forces, by the derivatives of
their integrals (Li and Mourikis 2014, "Online temporal calibration for camera-IMU systems"), where
no gyroscope shows it. All else is linear.

A lever arm that is known is added to the positions instead, as one turned by orientations with
noise would be drawn to zero by it.

Where the axes of the forces are turned against those of the camera is not estimated, as another
sensor shows it. The derivatives of the estimate by that rotation go along (consider parameters,
Schmidt 1966), so that the estimate can be corrected once it is known.
"""

from __future__ import annotations

import copy
import math

import numpy as np

from aick_ros import kernels
from aick_ros.geometry import definite, se3
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES, KalmanUpdate
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.inertial.force_integral import Impulse
from aick_ros.odometry.inertial.level import Direction
from aick_ros.settings import ImuSettings

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]; by definition."""

_GRAVITY_VARIANCE = 0.02 ** 2
"""Variance of its length [m^2/s^4]; derived: from the equator to the poles it is 9.78 to 9.83."""

_FIRST_VELOCITY = 1.0  # m/s; chosen: standard deviation of a velocity that is not known yet

_UNMODELLED = 0.02
"""Noise density of all that is no white noise [m/s^2/sqrt(Hz)], as of scale and axes.

Chosen on two excerpts of real recordings, where the tilt is the same with none and with twice as
much. On rendered rooms gravity is known later by it."""

_P, _V, _G, _B, _L = (slice(first, first + 3) for first in (0, 3, 6, 9, 12))
_T, _SIZE = 15, 16


class GravityFilter:
    """
    Estimate of position, velocity, gravity, bias, lever arm and time offset, with covariance.

    :param settings: noise of the accelerometer.
    :param force: first one, 3, in the axes of the camera [m/s^2]: gravity, and the bias.
    :param acceleration: 3x3, covariance of what else is in it, in the axes of the poses.
    :param pose: of the camera there, with its covariance.
    :param lever_arm_sigma: standard deviation of the lever arm along each axis [m].
    :param time_offset_sigma: that of the time offset [s].
    """

    def __init__(self, settings: ImuSettings, force: np.ndarray, acceleration: np.ndarray,
                 pose: PoseWithCovariance, lever_arm_sigma: float = 0.0,
                 time_offset_sigma: float = 0.0) -> None:
        self.configure(settings)
        self.values = np.zeros(_SIZE)
        self.values[_G] = pose.rotation @ force
        bias = settings.accelerometer_bias_sigma ** 2
        self.covariance = np.zeros((_SIZE, _SIZE))
        self.covariance[_G, _G] = acceleration + bias * np.eye(3)
        self.covariance[_B, _B] = bias * np.eye(3)
        self.covariance[_G, _B] = -bias * pose.rotation  # what is bias in the force is no gravity
        self.covariance[_B, _G] = self.covariance[_G, _B].T
        self.covariance[_L, _L] = lever_arm_sigma ** 2 * np.eye(3)
        self.covariance[_T, _T] = time_offset_sigma ** 2
        self._by_mounting = np.zeros((_SIZE, 3))  # of the values [1/rad]
        self._by_mounting[_G] = -pose.rotation @ se3.skew(force)
        self.place(pose)
        self._hold_length()

    def configure(self, settings: ImuSettings) -> None:
        """Continue with another noise; what was estimated is kept."""
        self._settings = settings

    def copy(self) -> GravityFilter:
        """Return a filter that goes on by itself."""
        other = copy.copy(self)
        other.values, other.covariance = self.values.copy(), self.covariance.copy()
        other._by_mounting = self._by_mounting.copy()
        return other

    @property
    def gravity(self) -> np.ndarray:
        """Gravity, 3, upwards [m/s^2]."""
        return self.values[_G]

    @property
    def up(self) -> Direction:
        """Direction of gravity, upwards."""
        gravity = self.gravity
        length = math.hypot(*gravity)
        return Direction(gravity / length, self.covariance[_G, _G] / length ** 2)

    @property
    def velocity_sigma(self) -> float:
        """Largest standard deviation of the velocity [m/s]."""
        return definite.largest_sigma(self.covariance[_V, _V])

    @property
    def bias(self) -> np.ndarray:
        """Bias of the forces, 3, in the axes of the camera [m/s^2]."""
        return self.values[_B]

    @property
    def lever_arm(self) -> np.ndarray:
        """Position of the accelerometer, 3, likewise [m]; zero where that is known."""
        return self.values[_L]

    @property
    def lever_arm_sigma(self) -> float:
        """Largest standard deviation of the lever arm [m]."""
        return definite.largest_sigma(self.covariance[_L, _L])

    @property
    def time_offset(self) -> float:
        """Time to add to the stamps of the images, beside the one known before [s]."""
        return float(self.values[_T])

    @property
    def time_offset_sigma(self) -> float:
        """Standard deviation of the time offset [s]."""
        return math.sqrt(self.covariance[_T, _T])

    def place(self, pose: PoseWithCovariance) -> None:
        """Continue at a pose that is measured, with an unknown velocity."""
        lever_arm = pose.rotation @ self.covariance[_L]  # its covariance with all values
        self.values[_P] = pose.translation + pose.rotation @ self.lever_arm
        self.values[_V] = 0.0
        self.covariance[_V], self.covariance[:, _V] = 0.0, 0.0
        self.covariance[_V, _V] = _FIRST_VELOCITY ** 2 * np.eye(3)
        self.covariance[_P], self.covariance[:, _P] = lever_arm, lever_arm.T
        self.covariance[_P, _V], self.covariance[_V, _P] = 0.0, 0.0
        self.covariance[_P, _P] = (
            pose.covariance[:3, :3] + lever_arm[:, _L] @ pose.rotation.T)
        self._by_mounting[_P] = pose.rotation @ self._by_mounting[_L]
        self._by_mounting[_V] = 0.0

    def from_origin(self) -> GravityFilter:
        """Return a filter that goes on by itself, with a position that is zero, and exact."""
        other = self.copy()
        other.values[_P] = 0.0
        other.covariance[_P], other.covariance[:, _P] = 0.0, 0.0
        other._by_mounting[_P] = 0.0
        return other

    def displacement(self, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """
        Return the displacement of the camera since the origin, 3, and its covariance, 3x3.

        It is beside that of a lever arm which is known before.

        :param turned: rotation of the camera now less that at the origin, 3x3.
        """
        rows = np.eye(3, _SIZE)
        rows[:, _L] = -turned
        return rows @ self.values, rows @ self.covariance @ rows.T

    def predict(self, impulse: Impulse, orientation: np.ndarray) -> None:
        """
        Advance by an interval.

        :param impulse: of the forces in it, by the time offset known so far.
        :param orientation: 3x3, covariance of the orientation in it [rad^2].
        """
        values, covariance = np.empty(_SIZE), np.empty((_SIZE, _SIZE))
        kernels.predict_gravity(
            self.values, self.covariance, impulse.duration, impulse.velocity, impulse.position,
            impulse.velocity_by_bias, impulse.position_by_bias,
            impulse.velocity_by_offset, impulse.position_by_offset, orientation,
            self._settings.accelerometer_noise ** 2 + _UNMODELLED ** 2,
            self._settings.accelerometer_bias_walk ** 2, values, covariance)
        self.values, self.covariance = values, covariance
        self._predict_by_mounting(impulse)

    def _predict_by_mounting(self, impulse: Impulse) -> None:
        """Advance the derivatives by the mounting, which changes the force like a bias across."""
        derivatives, time = self._by_mounting, impulse.duration
        force = impulse.velocity_by_bias.T @ impulse.velocity / time ** 2  # its mean
        bias, offset = derivatives[_B] + se3.skew(force), derivatives[_T]
        derivatives[_P] += (
            time * derivatives[_V] - 0.5 * time ** 2 * derivatives[_G]
            - impulse.position_by_bias @ bias + np.outer(impulse.position_by_offset, offset))
        derivatives[_V] += (
            - time * derivatives[_G]
            - impulse.velocity_by_bias @ bias + np.outer(impulse.velocity_by_offset, offset))

    def drift(self, covariance: np.ndarray) -> None:
        """Let the frame of the poses have moved by an error, with its covariance, 6x6."""
        arm = se3.skew(self.gravity)
        self.covariance[_P, _P] += covariance[:3, :3]
        self.covariance[_G, _G] += arm @ covariance[3:, 3:] @ arm.T

    def turn(self, rotation: np.ndarray) -> None:
        """Correct the estimate by a rotation, 3x3, by which all forces so far were turned."""
        self.values += self._by_mounting @ se3.log_rotation(rotation)

    def measure(self, pose: PoseWithCovariance) -> bool:
        """Update by a position, and return whether it is one of noise; else change nothing."""
        rows = np.eye(3, _SIZE)
        rows[:, _L] = -pose.rotation
        error = pose.translation - rows @ self.values
        if not self._measured(rows, pose.covariance[:3, :3], error, LARGEST_SQUARED_DISTANCES[3]):
            return False
        self._hold_length()
        return True

    def _measured(self, rows: np.ndarray, noise: np.ndarray, error: np.ndarray,
                  largest: float = math.inf) -> bool:
        """Update by a measurement, and return whether it is one of noise."""
        update = KalmanUpdate.of(self.covariance, rows, noise)
        if not update.squared_distance(error) <= largest:
            return False
        self.values = self.values + update.gain @ error
        self.covariance = update.covariance
        self._by_mounting = update.kept @ self._by_mounting
        return True

    def _hold_length(self) -> None:
        """
        Let the length of gravity be as certain as it is known, and no more, however often.

        An error e across gravity makes it longer by e^2 / 2 g, with a mean and a variance of its
        own (second-order filter, Bar-Shalom 2001, section 10.3). It is the same in all frames: as
        a new measurement in each it would seem certain, however far the start is tilted.
        """
        gravity = self.gravity
        length = math.hypot(*gravity)
        row = np.zeros((1, _SIZE))
        row[0, _G] = gravity / length
        projection = np.eye(3) - np.outer(gravity, gravity) / length ** 2
        across = projection @ self.covariance[_G, _G] @ projection
        longer = float(np.trace(across)) / (2.0 * length)
        known = _GRAVITY_VARIANCE + float(np.vdot(across, across)) / (2.0 * length ** 2)
        variance = float(np.squeeze(row @ self.covariance @ row.T))
        if variance <= known:
            return
        noise = np.array([[variance * known / (variance - known)]])  # that leaves what is known
        self._measured(row, noise, np.array([GRAVITY - length - longer]))
