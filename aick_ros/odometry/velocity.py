# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Velocity of the camera at the last tracked frame."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from aick_ros.geometry.pose import Increment
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.motion_model import MotionModel


@dataclass(frozen=True, eq=False)
class Velocity:
    """
    Velocity of the camera at the last tracked frame.

    :param twist: body velocity (vx, vy, vz, wx, wy, wz) [m/s, rad/s]; None: unknown.
    :param covariance: 6x6, of what the frames around it show; zero where nothing does.
    :param confirmed: stamp of the last frame that was registered by keypoints, or of the first
        frame [ns].
    :param is_confirmed: whether keypoints have shown the velocity there.
    :param unsteadiness: 6, mean squares of the errors of velocities at frames, by the interval
        before the frame [m^2/s^4, rad^2/s^4]; None: not known yet.
    """

    twist: np.ndarray | None = None
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))
    confirmed: int = 0
    is_confirmed: bool = False
    unsteadiness: np.ndarray | None = None

    @classmethod
    def by_keypoints(cls, increment: Increment, stamp: int,
                     unsteadiness: np.ndarray | None) -> Velocity:
        """Return the velocity after an increment that keypoints have measured up to a stamp."""
        return cls(increment.twist, _covariance(increment), stamp, True, unsteadiness)

    def by_depth(self, increment: Increment, stamp: int, model: MotionModel) -> Velocity:
        """Return the velocity after an increment that depth alone has measured up to a stamp."""
        twist = model.observed_twist(increment, seconds(self.confirmed, stamp))
        return replace(self, twist=twist, covariance=_covariance(increment))

    def variances_after(self, interval: float) -> np.ndarray | None:
        """Return those of a velocity at a frame after an interval [s], 6; None: not known yet."""
        return None if self.unsteadiness is None else self.unsteadiness * interval ** 2

    def with_twist(self, twist: np.ndarray | None) -> Velocity:
        """Return another body velocity, [m/s, rad/s], as certain and confirmed."""
        return replace(self, twist=twist)


def _covariance(increment: Increment) -> np.ndarray:
    covariance: np.ndarray = increment.pose.covariance / increment.interval ** 2
    return covariance
