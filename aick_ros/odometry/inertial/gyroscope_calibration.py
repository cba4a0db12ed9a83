# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Bias and time offset of a gyroscope, by a Kalman filter on the rotations that the camera measures.

Both are nearly constant and turn a rotation by known derivatives, so that each rotation of the
camera is a linear measurement of them.
"""

from __future__ import annotations

import numpy as np

from aick_ros.geometry.kalman import KalmanUpdate
from aick_ros.odometry.inertial.rotation_integral import Turn
from aick_ros.settings import ImuSettings


class GyroscopeCalibration:
    """
    Estimate of the bias [rad/s] and of the time offset [s], with covariance.

    The time offset is added to the stamps of the camera to get those of the gyroscope.

    :param settings: their first values and how fast the bias changes.
    """

    def __init__(self, settings: ImuSettings) -> None:
        self._walk = settings.gyroscope_bias_walk
        self.values = np.array([0.0, 0.0, 0.0, settings.time_offset])
        self.covariance = np.diag(np.square(
            [*3 * [settings.gyroscope_bias_sigma], settings.time_offset_sigma]))

    @property
    def bias(self) -> np.ndarray:
        """Bias of the turn rates, 3 [rad/s]."""
        return self.values[:3]

    @property
    def offset(self) -> float:
        """Time offset [s]."""
        return float(self.values[3])

    def uncertainty(self, turn: Turn) -> np.ndarray:
        """Return the covariance of a rotation by the errors of this calibration, 3x3 [rad^2]."""
        jacobian = _jacobian(turn)
        covariance: np.ndarray = jacobian @ self.covariance @ jacobian.T
        return covariance

    def elapse(self, interval: float) -> None:
        """Let the bias drift for some time [s]."""
        self.covariance[:3, :3] += self._walk ** 2 * interval * np.eye(3)

    def learn(self, turn: Turn, error: np.ndarray, covariance: np.ndarray) -> None:
        """
        Update the estimate by a rotation that the camera has measured too.

        :param error: 3, from the gyroscope's rotation to the camera's, in the axes at the start
            [rad].
        :param covariance: 3x3, of this error without that of the calibration.
        """
        update = KalmanUpdate.of(self.covariance, _jacobian(turn), covariance)
        self.values = self.values + update.gain @ error
        self.covariance = update.covariance


def _jacobian(turn: Turn) -> np.ndarray:
    """Return the derivatives of a rotation by bias and time offset, 3x4."""
    return np.column_stack([-turn.by_bias, turn.by_offset])
