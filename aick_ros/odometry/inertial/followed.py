# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The gravity filter through a time in which no pose is measured, step by step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.force_integral import ForceIntegral
from aick_ros.odometry.inertial.gravity_filter import GravityFilter

STEP = NANOSECONDS // 25
"""Longest time of one step [ns]; chosen: a hand turns evenly meanwhile."""


@dataclass(frozen=True, eq=False)
class Followed:
    """
    The gravity filter of a camera that is followed without measurements.

    :param stamp: up to which it is [ns].
    :param estimate: of the filter there.
    :param rotation: of the camera there, 3x3, in the axes of the estimate.
    """

    stamp: int
    estimate: GravityFilter
    rotation: np.ndarray

    def moved(self, end: int, rotation: np.ndarray, forces: ForceIntegral, offset: int,
              orientation: np.ndarray) -> Followed | None:
        """
        Return the filter a step later; None where samples are missing.

        :param end: stamp [ns] that is at most ``STEP`` later.
        :param rotation: of the camera then, 3x3.
        :param offset: time to add to the stamps of images to get those of the forces [ns].
        :param orientation: 3x3, covariance of the rotation meanwhile [rad^2].
        """
        impulse = forces.between(self.stamp + offset, end + offset, self.rotation, rotation)
        if impulse is None:
            return None
        estimate = self.estimate.copy()
        estimate.predict(impulse, orientation)
        return Followed(end, estimate, rotation)
