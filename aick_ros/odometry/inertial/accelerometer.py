# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The accelerometer as a sensor of motions, as long as the camera confirms it."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.inertial.displacement import Displacement, Limits
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.motion_term import MotionTerm
from aick_ros.settings import ImuSettings, OdometrySettings

_COMPARED = 0.5, 1.0
"""Shortest and longest time of a displacement that is compared with the camera [s].

Chosen: errors of scale and axes, which matter in darkness, exceed those of the camera by then."""

_MEMORY = 10  # comparisons; chosen: some seconds
_LARGEST = 100.0  # squared distance of one by its degrees of freedom; chosen: a sigma of ten


class Accelerometer:
    """
    Measures how far the camera has moved since the last frame whose pose was measured.

    It is used once the camera has confirmed a displacement. The gravity filter knows nothing of
    errors of the axes and of their scale, nor of vibrations: by how much displacements err more
    than it says is measured.

    :param gravity: velocity, gravity and bias at that frame.
    :param gyroscope: rotation since then.
    :param settings: how far it is followed.
    :param odometry: limits of the motion after that.
    """

    def __init__(self, gravity: Gravity, gyroscope: Gyroscope, settings: ImuSettings,
                 odometry: OdometrySettings) -> None:
        self._gravity, self._gyroscope = gravity, gyroscope
        self._count, self._mean = 0, 0.0  # of the squared distances, by degrees of freedom
        self.configure(settings, odometry)
        self.restart()

    def configure(self, settings: ImuSettings, odometry: OdometrySettings) -> None:
        """Continue with other settings, from the next frame that is measured."""
        self._limits = Limits(settings.dead_reckoning_sigma, MotionModel(odometry).unknown_speed)

    def restart(self) -> None:
        """Continue with frames that are measured anew; what was learned is kept."""
        self._displacement: Displacement | None = None
        self._start = self._end = 0  # of the term known [ns]
        self._term: MotionTerm | None = None
        self._compared: tuple[int, np.ndarray, Displacement] | None = None

    @property
    def factor(self) -> float:
        """Variance of a displacement, as a ratio to what the gravity filter says, at least 1."""
        return max(self._mean, 1.0)

    def term(self, start: int, end: int) -> MotionTerm | None:
        """
        Return the displacement between two stamps of images [ns]; None: it is not known.

        It is where the first one is that of the last frame whose pose was measured.
        """
        if (start != self._gravity.stamp or end <= start or not self._count
                or not self._limits.position_sigma):
            return None
        if start != self._start or (end < self._end and end != self._reached):
            self._displacement = self._gravity.displacement(
                self._gyroscope, self._limits, self.factor)
            self._start, self._end = start, start
        if end != self._end:
            self._term = None if self._displacement is None else self._displacement.term(end)
            self._end = end
        return self._term

    @property
    def _reached(self) -> int | None:
        return None if self._displacement is None else self._displacement.reached

    def knows(self, start: int, end: int) -> bool:
        """Return whether it has measured the displacement between two stamps [ns] to the end."""
        return (self.term(start, end) is not None
                and self._displacement is not None and self._displacement.is_followed)

    def known_until(self, start: int, end: int) -> int:
        """Return up to which stamp it has measured the displacement between two stamps [ns]."""
        reached = None if self.term(start, end) is None else self._reached
        return start if reached is None else reached

    def learn(self, stamp: int, T_reckoned_camera: np.ndarray) -> None:
        """
        Compare a displacement with the one that was measured by keypoints.

        :param stamp: of the last frame whose pose was measured [ns].
        :param T_reckoned_camera: that pose by dead reckoning, 4x4.
        """
        if self._compared is not None:
            start, T_reckoned_start, followed = self._compared
            shortest, longest = _COMPARED
            elapsed = seconds(start, stamp)
            if 0.0 < elapsed < shortest:
                return
            if shortest <= elapsed <= longest:
                self._note(followed.term(stamp), se3.inverse(T_reckoned_start) @ T_reckoned_camera)
        displacement = self._gravity.displacement(self._gyroscope, self._limits, 1.0)
        self._compared = None if displacement is None or stamp != self._gravity.stamp else (
            stamp, T_reckoned_camera, displacement)

    def _note(self, term: MotionTerm | None, seen: np.ndarray) -> None:
        """Note a displacement that the camera has measured, 4x4."""
        if term is None:
            return
        distance = term.added_to(PoseWithCovariance(seen)).squared_distance / len(term.rows)
        self._count = min(self._count + 1, _MEMORY)
        self._mean += (min(distance, _LARGEST) - self._mean) / self._count
