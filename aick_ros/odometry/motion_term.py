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

from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.pose_fusion import Fusion, with_measurement

POSITION = np.hstack([np.eye(3), np.zeros((3, 3))])
"""Rows of a term that measures the position alone."""

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

    def added_to(self, pose: PoseWithCovariance) -> Fusion:
        """Return a pose with this term; one without covariance stays as it is."""
        return with_measurement(pose, self.T_target_source, self.rows, self.covariance)
