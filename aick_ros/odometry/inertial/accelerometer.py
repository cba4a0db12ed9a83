# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The accelerometer as a sensor of motions from the last frame whose pose was measured."""

from __future__ import annotations

from aick_ros.odometry.inertial.displacement import Displacement
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.motion_term import MotionTerm


class Accelerometer:
    """
    Measures how far the camera has moved since the last frame whose pose was measured.

    :param gravity: velocity, gravity and bias there.
    :param gyroscope: rotation since then.
    :param speed_sigma: standard deviation of a velocity that is not known, along an axis [m/s].
    """

    def __init__(self, gravity: Gravity, gyroscope: Gyroscope, speed_sigma: float) -> None:
        self._gravity, self._gyroscope, self._speed_sigma = gravity, gyroscope, speed_sigma
        self._displacement: Displacement | None = None
        self._start = self._end = 0  # of the term known [ns]
        self._term: MotionTerm | None = None

    def term(self, start: int, end: int) -> MotionTerm | None:
        """
        Return the displacement between two stamps of images [ns]; None: it is not known.

        It is where the first one is that of the last frame whose pose was measured.
        """
        if start != self._gravity.stamp or end <= start:
            return None
        if start != self._start or end < self._end:
            self._displacement = self._gravity.displacement(
                self._gyroscope, self._speed_sigma)
            self._start, self._end = start, start
        if end != self._end:
            self._term = None if self._displacement is None else self._displacement.term(end)
            self._end = end
        return self._term

    def knows(self, start: int, end: int) -> bool:
        """Return whether it has measured the displacement between two stamps, to some dm."""
        return (self.term(start, end) is not None
                and self._displacement is not None and self._displacement.is_followed)
