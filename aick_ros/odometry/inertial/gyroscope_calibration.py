# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Errors of a gyroscope, by Kalman filters on the rotations that the camera measures.

Its bias, its time offset, and the scale and directions of its axes are nearly constant and turn a
rotation by known derivatives, so that each rotation of the camera is a linear measurement of them.
So is the error of the camera that rotations from one keyframe have in common, the more so the less
the view changes between them, with the noise of the rates since that keyframe.

Some gyroscopes have been calibrated, others have not. So there are filters for axes with errors of
several sizes, which count by how likely each makes what the camera measures (multiple models,
Magill 1965).
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES, KalmanUpdate
from aick_ros.odometry.inertial.rotation_integral import Turn
from aick_ros.settings import ImuSettings

_SIZES = {1.0: 1 / 4, 0.3: 1 / 8, 0.1: 1 / 8, 0.001: 1 / 2}
"""Sizes of the errors of axes by those of the settings -> how likely they are.

Chosen: dense enough that the truth is near one of them, as likely calibrated as not, and otherwise
most likely off as the settings say."""

_LEAST_LOGARITHM = -50.0  # of a likelihood by the largest one; chosen: no number underflows

_BIAS, _OFFSET, _MATRIX, _LASTING_ERROR = slice(0, 3), 3, slice(4, 13), slice(13, 16)
_CALIBRATION, _COUNT = slice(0, 13), 16
"""Indices of the values, and their number."""

_ROTATION = 0.5 * np.stack([se3.skew(axis).ravel() for axis in np.eye(3)])
"""Derivatives of a small rotation by the numbers of its matrix, 3x9; derived."""

_LASTING = 0.7
"""Share of the variance of the camera that frames in a row have in common.

Chosen, with the next one, on rendered recordings of three cameras by hand and shaken, by the
rotation over the next second and by its covariance."""

_ANOTHER_VIEW = math.radians(6.0)
"""Rotation by which what they have in common becomes independent [rad]; chosen likewise."""


class GyroscopeCalibration:
    """
    Estimate of the bias [rad/s], the time offset [s] and a matrix, with covariance.

    The time offset is added to the stamps of the camera to get those of the gyroscope. The matrix
    turns its rates, less the bias, into those of the camera.

    :param settings: the first values, and how fast the bias changes.
    """

    def __init__(self, settings: ImuSettings) -> None:
        self._begin(settings)
        self.configure(settings)

    def configure(self, settings: ImuSettings) -> None:
        """
        Continue with another noise and walk of the bias; what was learned is kept.

        With other first values it begins anew.
        """
        self._walk = settings.gyroscope_bias_walk
        self._noise = settings.gyroscope_noise ** 2
        if _first_values(settings) != self._begun_by:
            self._begin(settings)

    def _begin(self, settings: ImuSettings) -> None:
        self._begun_by = _first_values(settings)
        self.restart()
        self._filters = [_Filter(settings, size, weight) for size, weight in _SIZES.items()]
        self._join()

    def restart(self) -> None:
        """Continue with keyframes that are made anew."""
        self._last: tuple[int, Turn] | None = None  # stamp of its keyframe [ns], and the rotation

    @property
    def bias(self) -> np.ndarray:
        """Bias of the turn rates, 3 [rad/s]."""
        return self.values[_BIAS]

    @property
    def offset(self) -> float:
        """Time offset [s]."""
        return float(self.values[_OFFSET])

    @property
    def matrix(self) -> np.ndarray:
        """Matrix that corrects scale and directions of the axes, 3x3."""
        return self.values[_MATRIX].reshape(3, 3)

    @property
    def turned(self) -> np.ndarray:
        """Rotation that is part of the matrix, 3x3 (polar decomposition)."""
        left, _, right = np.linalg.svd(self.matrix)
        rotation: np.ndarray = left @ right
        return rotation

    @property
    def turned_variance(self) -> float:
        """Variance of that rotation, summed over its axes [rad^2]."""
        return float(np.trace(_ROTATION @ self.covariance[_MATRIX, _MATRIX] @ _ROTATION.T))

    @property
    def axes_correction(self) -> tuple[float, float]:
        """By how much the matrix turns the axes [rad], and scales one at most."""
        scales = np.linalg.svd(self.matrix, compute_uv=False)
        return se3.angle(self.turned), float(np.abs(scales - 1.0).max())

    def uncertainty(self, turn: Turn) -> np.ndarray:
        """Return the covariance of a rotation by the errors of this calibration, 3x3 [rad^2]."""
        jacobian = _jacobian(turn)[:, _CALIBRATION]
        known = self.covariance[_CALIBRATION, _CALIBRATION]
        covariance: np.ndarray = jacobian @ known @ jacobian.T
        return covariance

    def elapse(self, interval: float) -> None:
        """Let the bias drift for some time [s]."""
        for covariance in (self.covariance, *(each.covariance for each in self._filters)):
            covariance[_BIAS, _BIAS] += self._walk ** 2 * interval * np.eye(3)

    def learn(self, keyframe: int, turn: Turn, error: np.ndarray, covariance: np.ndarray) -> None:
        """
        Update the estimate by a rotation that the camera has measured too.

        :param keyframe: stamp of the image that the rotation begins at [ns].
        :param error: 3, from the gyroscope's rotation to the camera's, in the axes at the start
            [rad].
        :param covariance: 3x3, of this error by the camera alone.
        """
        jacobian = _jacobian(turn)
        if self._last is None or keyframe != self._last[0]:
            self._change_error(0.0, self._noise * turn.duration * np.eye(3))
            covariance = self._credible(jacobian, error, covariance)
            self._change_error(1.0, _LASTING * covariance)
        else:
            before = self._last[1]
            kept = math.exp(-se3.angle(before.rotation.T @ turn.rotation) / _ANOTHER_VIEW)
            noise = self._noise * (turn.duration - before.duration) * np.eye(3)
            self._change_error(kept, (1.0 - kept ** 2) * _LASTING * covariance + noise)
        self._last = keyframe, turn
        error = error - self.values[_LASTING_ERROR]
        noise = self._credible(jacobian, error, (1.0 - _LASTING) * covariance)
        for each in self._filters:
            each.learn(jacobian, error + jacobian @ (self.values - each.values), noise)
        self._join()

    def _change_error(self, kept: float, added: np.ndarray) -> None:
        """
        Change the error that lasts.

        :param kept: what it is multiplied by.
        :param added: covariance of what is added, 3x3 [rad^2].
        """
        for each in self._filters:
            each.change_error(kept, added)
        self._join()

    def _credible(self, jacobian: np.ndarray, error: np.ndarray,
                  covariance: np.ndarray) -> np.ndarray:
        """Return the covariance of an error or, where it is too large, one by which it may be."""
        square = KalmanUpdate.of(self.covariance, jacobian, covariance).squared_distance(error)
        larger: np.ndarray = max(square / LARGEST_SQUARED_DISTANCES[3], 1.0) * covariance
        return larger

    def _join(self) -> None:
        """Take mean and covariance of all filters together."""
        most = max(each.logarithm for each in self._filters)
        for each in self._filters:
            each.logarithm = max(each.logarithm - most, _LEAST_LOGARITHM)
        weights = np.exp([each.logarithm for each in self._filters])
        weights /= weights.sum()
        values = np.array([each.values for each in self._filters])
        self.values: np.ndarray = weights @ values
        apart = values - self.values
        self.covariance: np.ndarray = apart.T @ (weights[:, None] * apart) + np.tensordot(
            weights, [each.covariance for each in self._filters], 1)


class _Filter:
    """
    Values and their covariance, if scale and directions of the axes have errors of some size.

    :param size: of these errors by those of the settings; weight: how likely it is.
    """

    def __init__(self, settings: ImuSettings, size: float, weight: float) -> None:
        self.values = np.zeros(_COUNT)
        self.values[_OFFSET], self.values[_MATRIX] = settings.time_offset, np.eye(3).ravel()
        self.covariance = np.zeros((_COUNT, _COUNT))
        self.covariance[_BIAS, _BIAS] = settings.gyroscope_bias_sigma ** 2 * np.eye(3)
        self.covariance[_OFFSET, _OFFSET] = settings.time_offset_sigma ** 2
        turns = np.array([se3.skew(axis).ravel() for axis in np.eye(3)])
        self.covariance[_MATRIX, _MATRIX] = (
            (size * settings.gyroscope_scale_sigma) ** 2 * np.eye(9)
            + (size * settings.mounting_sigma) ** 2 * turns.T @ turns)
        self.logarithm = math.log(weight)

    def change_error(self, kept: float, added: np.ndarray) -> None:
        """Multiply the error that lasts, and add one with a covariance, 3x3 [rad^2]."""
        self.values[_LASTING_ERROR] *= kept
        self.covariance[_LASTING_ERROR] *= kept
        self.covariance[:, _LASTING_ERROR] *= kept
        self.covariance[_LASTING_ERROR, _LASTING_ERROR] += added

    def learn(self, jacobian: np.ndarray, error: np.ndarray, covariance: np.ndarray) -> None:
        """Update the values by an error of a rotation, 3 [rad], with these derivatives, 3x16."""
        update = KalmanUpdate.of(self.covariance, jacobian, covariance)
        self.values = self.values + update.gain @ error
        self.covariance = update.covariance
        self.logarithm -= 0.5 * (update.squared_distance(error)
                                 + float(np.linalg.slogdet(update.expected).logabsdet))


def _first_values(settings: ImuSettings) -> tuple[float, ...]:
    """Return the settings that hold until something is learned."""
    return (settings.gyroscope_bias_sigma, settings.gyroscope_scale_sigma,
            settings.mounting_sigma, settings.time_offset, settings.time_offset_sigma)


def _jacobian(turn: Turn) -> np.ndarray:
    """Return the derivatives of a rotation by all values, 3x16."""
    return np.column_stack([-turn.by_bias, turn.by_offset, turn.by_matrix, np.eye(3)])
