# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The motion expected as a prior: which of two poses continues it.

An object that moves before a camera shows a motion which begins at once. The scene beside it goes
on as before.
"""

from __future__ import annotations

import numpy as np

from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.pose_fusion import differ
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.settings import OdometrySettings

_SIGMA_FACTORS = 5.0 / 3.0, 1.0
"""Standard deviations of the acceleration and of the angular one, by the sigmas of the motion
model. Chosen on rendered rooms with boards that move through 10 to 60 % of the view."""

_SHORTEST = 0.005  # s; chosen: stamps that are closer, as of a burst, are no times of images
_LONGEST = 10.0  # s; a camera may be 250 m from where it was expected then: nothing is known


class MotionPrior:
    """
    Compares poses with the motion expected.

    :param settings: the acceleration noise of the motion model.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        sigmas = settings.acceleration_sigma, settings.angular_acceleration_sigma
        self._sigmas = np.repeat(np.multiply(_SIGMA_FACTORS, sigmas), 3)

    def of(self, expected: ExpectedPose) -> PoseWithCovariance:
        """Return the motion expected, with its covariance by the motion model and by stamps."""
        elapsed = min(max(expected.elapsed, _SHORTEST), _LONGEST)
        return PoseWithCovariance(expected.T_target_source, np.diag(
            (0.5 * self._sigmas * elapsed ** 2) ** 2 + np.repeat(expected.timing, 3) ** 2))

    def is_exceeded_by(self, pose: PoseWithCovariance, expected: ExpectedPose) -> bool:
        """
        Return whether a pose is off the one expected by more than both covariances explain.

        :param pose: ``T_target_source``.
        """
        return differ(self.of(expected), pose)

    def is_continued_by(self, pose: PoseWithCovariance, other: PoseWithCovariance,
                        expected: ExpectedPose) -> bool:
        """Return whether a pose does not differ from the one expected, and another one does."""
        return (not self.is_exceeded_by(pose, expected) and self.is_exceeded_by(other, expected)
                and differ(pose, other))
