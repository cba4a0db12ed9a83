# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What makes a registration wrong beyond the noise of its residuals.

The two sensors of the camera measure the same motion. Where they disagree by more than their
noise, calibration, shutters or clocks are not what the model takes them for, and the covariance
of the noise alone would be a lie. Where they disagree far more than they use to, something may
move before the camera. Stamps that jitter tell of a clock that lags.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.registration.result import SensorBias, Registration

_MEMORY = 30  # registrations
_EXPLAINED = 1.2, 1.7
"""Squared bias by its covariance that noise may come to, and that it never comes to."""

_UNSEEN, _UNSEEN_DISAGREEMENT = 3, (0.003, np.radians(0.15))
"""What a camera not seen yet is taken for, and for how many registrations that counts [m, rad].

A Kinect's sensors disagree by 3 to 10 mm and 0.1 to 0.3 deg.
"""

_UNUSUAL = 1.7, 2.3
"""The same of a single registration, by what is usual, which is at least the noise."""

_SHAKEN, _LAG = 3.3, 12.0
"""Error of each stamp, and delay of them all, by the jitter, of stamps given on arrival.

Measured on a Kinect: about 5 ms and 15 to 25 ms where they jitter by 1.2 to 3.3 ms.
"""


class Uncertainty:
    """Completes the covariances of the registrations of one camera, in the order of time."""

    def __init__(self) -> None:
        self._count = _UNSEEN
        # mean bias along an axis, about an axis, squared
        self._squares = np.square(_UNSEEN_DISAGREEMENT)
        # mean of their squares by their covariances, 1 where noise explains it
        self._ratio = _EXPLAINED[1]

    def complete(self, registration: Registration, source: PreparedFrame, target: PreparedFrame,
                 expected: np.ndarray | None = None, elapsed: float = np.inf) -> Registration:
        """
        Return a registration with the covariance of all that is known to make it wrong.

        :param expected: ``T_target_source`` at constant velocity; None where none is known.
        :param elapsed: since that velocity was seen [s], at most the time between the views.
        """
        if not registration.status.ok:
            return registration
        covariance = registration.covariance + _timing(
            registration.T_target_source, source, target, expected, elapsed)
        if registration.bias is not None:
            ratio, squares = _measured(registration.bias)
            covariance += _unexplained(ratio / max(self._ratio, 1.0), squares, _UNUSUAL)
            self._learn(ratio, squares)
        if self._count > _UNSEEN:
            covariance += _unexplained(self._ratio, self._squares, _EXPLAINED)
        return dataclasses.replace(registration, covariance=covariance)

    def _learn(self, ratio: float, squares: np.ndarray) -> None:
        self._count = min(self._count + 1, _MEMORY)
        self._ratio += (ratio - self._ratio) / self._count
        self._squares += (squares - self._squares) / self._count


def _measured(bias: SensorBias) -> tuple[float, np.ndarray]:
    """Return its square by its covariance, and its squares along an axis and about one."""
    difference = bias.difference
    ratio = difference @ np.linalg.solve(bias.covariance, difference) / 6
    return float(ratio), np.mean(difference.reshape(2, 3) ** 2, axis=1)


def _unexplained(ratio: float, squares: np.ndarray, bounds: tuple[float, float]) -> np.ndarray:
    """Return the covariance of a bias that noise does not explain, 6x6."""
    noise, surely_more = bounds
    share = np.clip((ratio - noise) / (surely_more - noise), 0.0, 1.0)
    return np.diag(np.repeat(share * squares, 3))


def _timing(T_target_source: np.ndarray, source: PreparedFrame, target: PreparedFrame,
            expected: np.ndarray | None, elapsed: float) -> np.ndarray:
    """Return the covariance of a motion between two moments that are not quite known, 6x6."""
    interval = (source.stamp - target.stamp) / NANOSECONDS
    if interval == 0.0:
        return np.zeros((6, 6))  # of one moment: no speed is known
    jitter = max(source.stamp_jitter, target.stamp_jitter)
    variances = 2 * (_SHAKEN * jitter) ** 2 * _squared_rates(T_target_source, interval)
    if expected is not None:
        change = se3.inverse(expected) @ T_target_source
        variances += (_LAG * jitter) ** 2 * _squared_rates(change, min(elapsed, abs(interval))) / 3
    return np.diag(np.repeat(variances, 3))


def _squared_rates(motion: np.ndarray, interval: float) -> np.ndarray:
    """Return the squares of the speed [m^2/s^2] and the turn rate [rad^2/s^2]."""
    twist = se3.log(motion) / interval
    return np.array([twist[:3] @ twist[:3], twist[3:] @ twist[3:]])
