# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Positions that are held by the motion before them, as far as they are uncertain."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import kalman
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.settings import OdometrySettings

_POSITION = np.eye(3, 6)  # by definition: it is what is measured
_OF_POSITION, _OF_VELOCITY = np.eye(6, 3), np.eye(6, 3, -3)  # by definition: their rows
_AXES, _UNMOVED = np.eye(3), np.eye(4)
_STEADY, _BY_TIME = np.eye(6), np.eye(6, 6, 3)  # by definition: the former moves by the latter
_FIRST_VELOCITY = 1.0  # m/s; chosen: standard deviation of a velocity that is not known yet


class PositionFilter:
    """
    Kalman filter of the camera's position at constant velocity, with acceleration noise.

    The noise of a registration goes into the distance to the frame before and into that to the
    next one. A position that was measured well follows the measurement; where the view is weak
    the velocity holds it, unless the camera was knocked. Poses are measured without the filter
    and published through it, so that what it holds back does not add up. Orientations are
    measured well enough to be left alone.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        self.configure(settings)
        self.reset()

    def configure(self, settings: OdometrySettings) -> None:
        """Continue with other settings; without the motion prior positions stay as measured."""
        self._is_used = settings.motion_prior
        self._acceleration_sigma = settings.acceleration_sigma

    def reset(self) -> None:
        """Forget all poses."""
        self._stamp: int | None = None
        self._measured, self._covariance = np.eye(4), np.zeros((6, 6))
        self._values = np.zeros(6)  # position and velocity
        self._is_velocity_known = False

    @property
    def T_measured_filtered(self) -> np.ndarray:
        """Filtered pose of the last frame in the frame of the measured one, 4x4."""
        offset = _UNMOVED.copy()
        offset[:3, 3] = self._measured[:3, :3].T @ (self._values[:3] - self._measured[:3, 3])
        return offset

    @property
    def velocity(self) -> np.ndarray | None:
        """Velocity of the last frame along the axes of its camera, 3 [m/s]; None: not known."""
        return self._measured[:3, :3].T @ self._values[3:] if self._is_velocity_known else None

    def update(self, stamp: int, measured: PoseWithCovariance) -> None:
        """
        Add the next measured pose.

        :param stamp: [ns].
        :param measured: with the covariance of this measurement alone.
        """
        self._measured = measured.matrix
        last, self._stamp = self._stamp, stamp
        if last is None or not self._is_used:
            self._begin(measured)
            return
        self._predict(seconds(last, stamp))
        error = measured.translation - self._values[:3]
        estimate = kalman.measured(
            self._values, self._covariance, _POSITION, measured.covariance[:3, :3], error,
            LARGEST_SQUARED_DISTANCES[3])
        if estimate is None:  # the camera was knocked
            self._begin(measured)
            return
        self._values, self._covariance = estimate
        self._is_velocity_known = True

    def _begin(self, measured: PoseWithCovariance) -> None:
        """Take a position as it is measured, and forget the velocity."""
        self._values = np.zeros(6)
        self._values[:3] = measured.translation
        self._is_velocity_known = False
        self._covariance = np.diag(np.repeat([0.0, _FIRST_VELOCITY ** 2], 3))
        self._covariance[:3, :3] = measured.covariance[:3, :3]

    def _predict(self, elapsed: float) -> None:
        """Move on by some time [s]."""
        transition = _STEADY + elapsed * _BY_TIME
        by_acceleration = 0.5 * elapsed ** 2 * _OF_POSITION + elapsed * _OF_VELOCITY
        self._values = transition @ self._values
        self._covariance = kalman.propagated(
            transition, self._covariance, by_acceleration, self._acceleration_sigma ** 2 * _AXES)
