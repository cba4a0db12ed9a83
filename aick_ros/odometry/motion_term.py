# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
What another sensor says about a motion, as a term of the least-squares problem of its pose.

The images give a pose with its covariance, which is the minimum of their own residuals with its
curvature. A term of another sensor is linear in the error of that pose, so that the minimum with
the term is one step away (Kalman update).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.kalman import LARGEST_SQUARED_DISTANCES, KalmanUpdate
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.pose_fusion import with_measurement

ROTATION = np.hstack([np.zeros((3, 3)), np.eye(3)])
"""Rows of a term that measures the rotation alone."""


@dataclass(frozen=True, eq=False)
class MotionTerm:
    """
    A measurement of some directions of a motion.

    :param T_target_source: the motion measured, 4x4 [m]; what the rows do not see is ignored.
    :param rows: Kx6, orthonormal: the directions of the error (x, y, z, rot x, rot y, rot z) in
        the fixed axes of the target that are measured.
    :param covariance: KxK, of these [m^2, m rad, rad^2].
    """

    T_target_source: np.ndarray
    rows: np.ndarray
    covariance: np.ndarray

    def error(self, pose: np.ndarray) -> np.ndarray:
        """Return the measured motion less a pose, 4x4, along the rows, K."""
        error: np.ndarray = self.rows @ se3.difference(self.T_target_source, pose)
        return error

    def added_to(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return the pose with this term; one without covariance stays as it is."""
        return with_measurement(pose, self.T_target_source, self.rows, self.covariance)

    def kept(self, pose: PoseWithCovariance) -> np.ndarray:
        """Return the share of the error of a pose that is left with this term, 6x6."""
        return self._update(pose).kept

    def squared_distance(self, pose: PoseWithCovariance) -> float:
        """Return the squared error of a pose by its covariance; noise gives K in the mean."""
        return self._update(pose).squared_distance(self.error(pose.matrix))

    def agrees_with(self, pose: PoseWithCovariance) -> bool:
        """Return whether a pose differs by no more than noise, which does once in a thousand."""
        return self.squared_distance(pose) <= LARGEST_SQUARED_DISTANCES[len(self.rows)]

    def _update(self, pose: PoseWithCovariance) -> KalmanUpdate:
        return KalmanUpdate.of(pose.covariance, self.rows, self.covariance)
