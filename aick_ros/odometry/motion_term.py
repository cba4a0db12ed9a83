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
from aick_ros.geometry.pose import PoseWithCovariance

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
        gain, kept = self._gain(pose)
        covariance = kept @ pose.covariance @ kept.T + gain @ self.covariance @ gain.T
        return PoseWithCovariance(
            se3.perturbed(pose.matrix, gain @ self.error(pose.matrix)),
            0.5 * (covariance + covariance.T))

    def kept(self, pose: PoseWithCovariance) -> np.ndarray:
        """Return the share of the error of a pose that is left with this term, 6x6."""
        return self._gain(pose)[1]

    def disagreement(self, pose: PoseWithCovariance) -> float:
        """Return the squared error of a pose by its covariance, per row; noise gives 1."""
        error = self.error(pose.matrix)
        return float(error @ np.linalg.solve(self._expected(pose), error)) / len(error)

    def _expected(self, pose: PoseWithCovariance) -> np.ndarray:
        """Return the covariance of the error, KxK."""
        expected: np.ndarray = self.rows @ pose.covariance @ self.rows.T + self.covariance
        return expected

    def _gain(self, pose: PoseWithCovariance) -> tuple[np.ndarray, np.ndarray]:
        gain = pose.covariance @ self.rows.T @ np.linalg.inv(self._expected(pose))
        return gain, np.eye(6) - gain @ self.rows
