# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Corrections of the pose without a jump (REP-105)."""

from __future__ import annotations

import math

import numpy as np

from aick_ros.geometry import se3
from aick_ros.settings import OdometrySettings

_TIME = 2.0
"""Time constant of the correction [s], as long as its steps are not the largest.

Chosen on an excerpt of a real recording and four rendered ones: with half of it the relative
errors over one second grow by up to 6 percent, and the absolute ones shrink by up to 10.
"""


class PoseCorrection:
    """
    Transform from the frame of the dead reckoning to that of the published poses.

    It approaches a better estimate by at most a step per frame; between steps it is constant, so
    that the motion from frame to frame stays as measured.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        self.T_odom_reckoned = np.eye(4)
        """The transform, 4x4."""
        self.configure(settings)

    def configure(self, settings: OdometrySettings) -> None:
        """Change the largest step of the frames that follow."""
        self._max_step, self._max_turn = settings.correction_step, settings.correction_turn

    def approach(self, T_odom_camera: np.ndarray, T_reckoned_camera: np.ndarray,
                 interval: float) -> np.ndarray:
        """
        Move the published pose of a frame towards an estimate of it.

        :param T_odom_camera: the estimate, 4x4.
        :param T_reckoned_camera: the same frame by dead reckoning, 4x4.
        :param interval: since the frame before [s].
        :returns: the error that is left (x, y, z, rot x, rot y, rot z) [m, rad], 6.
        """
        published = self.T_odom_reckoned @ T_reckoned_camera
        error = se3.difference(T_odom_camera, published)
        if not error.any():
            return error
        distance, angle = math.hypot(*error[:3]), math.hypot(*error[3:])
        share = min(interval / _TIME, 1.0, self._max_step / max(distance, 1e-12),
                    self._max_turn / max(angle, 1e-12))
        self.T_odom_reckoned = (se3.perturbed(published, share * error)
                                @ se3.inverse(T_reckoned_camera))
        return (1.0 - share) * error
