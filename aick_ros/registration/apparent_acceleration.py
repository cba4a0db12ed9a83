# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Acceleration that registrations show against the motion expected, frame by frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import RESTART_AFTER
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.result import Registration
from aick_ros.settings import OdometrySettings


class _Shown(NamedTuple):
    """Acceleration that a frame has shown against the motion expected, 6 [m/s^2, rad/s^2]."""

    stamp: int
    acceleration: np.ndarray


class ApparentAcceleration:
    """
    Tells how far a motion may be from the one expected, by the motion model and the last frame.

    The motion that is expected may be wrong itself, by a mistake in the frame before. So it is
    taken as no more certain than that frame agreed with what had been expected of it.

    :param settings: the acceleration noise of the motion model.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        self._sigmas = np.repeat(
            [settings.acceleration_sigma, settings.angular_acceleration_sigma], 3)
        self._before: _Shown | None = None
        self._last: _Shown | None = None

    def sigmas(self, stamp: int, expected: ExpectedPose) -> np.ndarray:
        """
        Return the standard deviations of the difference from the motion expected, 6 [m, rad].

        :param stamp: of the frame [ns].
        """
        last = self._before if self._is_last(stamp) else self._last
        shown = np.zeros(6)
        if last is not None and 0 < stamp - last.stamp < RESTART_AFTER:
            shown = last.acceleration  # else it is of another recording, or of long before
        sigmas: np.ndarray = np.hypot(
            0.5 * np.hypot(self._sigmas, shown) * expected.elapsed ** 2,
            np.repeat(expected.timing, 3))
        return sigmas

    def note(self, stamp: int, found: Registration, expected: ExpectedPose) -> None:
        """Note what a registration of a frame shows; it may be registered several times."""
        if not found.status.ok or expected.elapsed <= 0.0:
            return
        if not self._is_last(stamp):
            self._before = self._last
        difference = se3.difference(found.T_target_source, expected.T_target_source)
        self._last = _Shown(stamp, 2.0 * difference / expected.elapsed ** 2)

    def _is_last(self, stamp: int) -> bool:
        return self._last is not None and stamp == self._last.stamp
