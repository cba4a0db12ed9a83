# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The odometry that a node published while a bag was played to it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from aick_ros.ros.conversions import UNKNOWN


@dataclass(frozen=True, eq=False)
class Answer:
    """
    One odometry message.

    :param stamp: stamp of the image that it answers [ns].
    :param T_odom_base: 4x4.
    :param covariance: 6x6 of the pose, as received.
    :param twist: (vx, vy, vz, wx, wy, wz) in the base frame [m/s, rad/s].
    :param received_at: monotonic time [s].
    """

    stamp: int
    T_odom_base: np.ndarray
    covariance: np.ndarray
    twist: np.ndarray
    received_at: float

    @property
    def tracked(self) -> bool:
        """An answer whose pose was measured."""
        return bool(self.covariance[0, 0] < UNKNOWN[0, 0])


@dataclass
class LiveRun:
    """
    Images played and odometry received.

    :param published_at: stamp of each colour image [ns] -> monotonic time of publishing [s].
    :param answers: in order of arrival.
    """

    published_at: dict[int, float] = field(default_factory=dict)
    answers: list[Answer] = field(default_factory=list)

    @property
    def delays(self) -> np.ndarray:
        """Time from publishing the colour image to receiving each answer [s]."""
        return np.array([answer.received_at - self.published_at[answer.stamp]
                         for answer in self.answers])

    @property
    def rate(self) -> float:
        """Rate of the answers [Hz]; 0 where there are fewer than two."""
        if len(self.answers) < 2:
            return 0.0
        span = self.answers[-1].received_at - self.answers[0].received_at
        return (len(self.answers) - 1) / span

    def of_played_images(self) -> LiveRun:
        """Return the run without answers to images that were not played."""
        return LiveRun(self.published_at, [
            answer for answer in self.answers if answer.stamp in self.published_at])
