# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Systematic errors of a registration, which the noise of its residuals does not show.

Keypoints and depth images measure the same motion. A bias between them that is larger than their
noise means an error of calibration, shutter or clock, and a bias far larger than usual means that
something may move in front of the camera. Jitter of the stamps means that the clock lags.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.result import Registration, SensorBias

_MEMORY = 30  # registrations; chosen

_PRIOR_BIAS, _PRIOR_WEIGHT = (0.003, np.radians(0.15)), 3
"""Prior of the bias between keypoints and depth [m, rad], and its weight in registrations.

Measured on a Kinect: 3 to 10 mm and 0.1 to 0.3 degrees. The weight is chosen.
"""

_USUAL_BOUNDS = 1.2, 1.7
"""Normalised squared bias, mean of many: up to the first it is noise, from the second on it is
fully systematic, linear in between. Chosen; noise alone gives 1."""

_SINGLE_BOUNDS = 1.7, 2.3
"""The same bounds for the normalised squared bias of one registration, as a ratio to the usual
one (at least 1). Chosen."""

_STAMP_SIGMA_PER_JITTER = 3.3
"""Standard deviation of each stamp by the jitter, for stamps given on arrival.

Measured on a Kinect: about 5 ms, where stamps jitter by 1.2 to 3.3 ms."""

_LATENCY_SIGMA_PER_JITTER = 12.0
"""Standard deviation of the common delay of all stamps by the jitter.

Measured on a Kinect: 15 to 25 ms, where stamps jitter by 1.2 to 3.3 ms."""


class SystematicError:
    """Adds systematic errors to the covariances of one camera's registrations, in time order."""

    def __init__(self) -> None:
        self._count = _PRIOR_WEIGHT
        self._squares = np.square(_PRIOR_BIAS)  # mean squared bias along an axis, about an axis
        self._normalised = _USUAL_BOUNDS[1]  # mean normalised squared bias

    def add_to(self, registration: Registration, source: PreparedFrame, target: PreparedFrame,
               expected: np.ndarray | None = None, elapsed: float = np.inf) -> Registration:
        """
        Return a registration with the covariance of noise and systematic errors.

        :param expected: ``T_target_source`` at constant velocity, 4x4; None where unknown.
        :param elapsed: time since that velocity was measured, at most the time between the
            frames [s].
        """
        if not registration.status.ok:
            return registration
        covariance = registration.covariance + _timing(
            registration.T_target_source, source, target, expected, elapsed)
        if registration.bias is not None:
            normalised, squares = _squared(registration.bias)
            covariance += _systematic(normalised / max(self._normalised, 1.0), squares,
                                      _SINGLE_BOUNDS)
            self._learn(normalised, squares)
        if self._count > _PRIOR_WEIGHT:
            covariance += _systematic(self._normalised, self._squares, _USUAL_BOUNDS)
        return dataclasses.replace(registration, covariance=covariance)

    def _learn(self, normalised: float, squares: np.ndarray) -> None:
        self._count = min(self._count + 1, _MEMORY)
        self._normalised += (normalised - self._normalised) / self._count
        self._squares += (squares - self._squares) / self._count


def _squared(bias: SensorBias) -> tuple[float, np.ndarray]:
    """Return the square of a bias normalised by its covariance, and along and about an axis."""
    difference = bias.difference
    normalised = difference @ np.linalg.solve(bias.covariance, difference) / 6
    return float(normalised), np.mean(difference.reshape(2, 3) ** 2, axis=1)


def _systematic(normalised: float, squares: np.ndarray,
                bounds: tuple[float, float]) -> np.ndarray:
    """Return the covariance of the systematic share of a bias, 6x6."""
    noise, systematic = bounds
    share = np.clip((normalised - noise) / (systematic - noise), 0.0, 1.0)
    return np.diag(np.repeat(share * squares, 3))


def _timing(T_target_source: np.ndarray, source: PreparedFrame, target: PreparedFrame,
            expected: np.ndarray | None, elapsed: float) -> np.ndarray:
    """Return the covariance of a motion due to errors of the two stamps, 6x6."""
    interval = (source.stamp - target.stamp) / NANOSECONDS
    if interval == 0.0:
        return np.zeros((6, 6))  # no speed is known
    jitter = max(source.stamp_jitter, target.stamp_jitter)
    stamp_sigma = _STAMP_SIGMA_PER_JITTER * jitter
    variances = 2 * stamp_sigma ** 2 * _squared_rates(T_target_source, interval)
    if expected is not None:
        # a common delay shifts the motion by the change of the velocity, in a third per axis
        change = se3.inverse(expected) @ T_target_source
        latency_sigma = _LATENCY_SIGMA_PER_JITTER * jitter
        variances += latency_sigma ** 2 * _squared_rates(
            change, min(elapsed, abs(interval))) / 3
    return np.diag(np.repeat(variances, 3))


def _squared_rates(motion: np.ndarray, interval: float) -> np.ndarray:
    """Return the squared speed [m^2/s^2] and the squared turn rate [rad^2/s^2], 2."""
    twist = se3.log(motion) / interval
    return np.array([twist[:3] @ twist[:3], twist[3:] @ twist[3:]])
