# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Fusion of a pose with independent measurements of it (Kalman update, to first order)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES, KalmanUpdate
from aick_ros.geometry.pose import PoseWithCovariance


@dataclass(frozen=True, eq=False)
class Fusion:
    """
    A pose with a measurement of some directions of it.

    :param pose: that results.
    :param error: K, the measurement less the pose before, along these directions.
    :param update: of the pose by the measurement.
    """

    pose: PoseWithCovariance
    error: np.ndarray
    update: KalmanUpdate

    @property
    def squared_distance(self) -> float:
        """Squared error by its covariance; noise gives K in the mean."""
        return self.update.squared_distance(self.error)

    @property
    def is_of_noise(self) -> bool:
        """Agreement of the two within noise, which is larger once in a thousand times."""
        return self.squared_distance <= LARGEST_SQUARED_DISTANCES[len(self.error)]


def with_measurement(pose: PoseWithCovariance, measured: np.ndarray, rows: np.ndarray,
                     noise: np.ndarray) -> Fusion:
    """
    Return a pose with a measurement of some directions of it.

    :param measured: the pose measured, 4x4 [m]; what the rows do not see is ignored.
    :param rows: Kx6, directions of the error (x, y, z, rot x, rot y, rot z) in the fixed axes of
        the target.
    :param noise: KxK, covariance of the measurement along these [m^2, m rad, rad^2].
    """
    update = KalmanUpdate.of(pose.covariance, rows, noise)
    error = rows @ se3.difference(measured, pose.matrix)
    moved = se3.perturbed(pose.matrix, update.gain @ error)
    return Fusion(PoseWithCovariance(moved, update.covariance), error, update)


def fused(pose: PoseWithCovariance, other: PoseWithCovariance) -> PoseWithCovariance:
    """Return the pose that two independent estimates of it give together."""
    return with_measurement(pose, other.matrix, np.eye(6), other.covariance).pose


def differ(one: PoseWithCovariance, other: PoseWithCovariance) -> bool:
    """
    Return whether two estimates of a pose differ by more than both covariances explain.

    They do where their squared distance exceeds the 99.9 % quantile of the chi-squared
    distribution with six degrees of freedom, as noise does once in a thousand times.
    """
    return not with_measurement(one, other.matrix, np.eye(6), other.covariance).is_of_noise
