# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Acceleration that registrations show against the motion expected, frame by frame."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import RESTART_AFTER
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.registration.result import Registration
from aick_ros.settings import OdometrySettings


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
        self._before = self._last = 0, np.zeros(6)  # stamps, and what their frames have shown

    def sigmas(self, stamp: int, elapsed: float) -> np.ndarray:
        """
        Return the standard deviations of the difference from the motion expected, 6 [m, rad].

        :param stamp: of the frame [ns].
        :param elapsed: time since the velocity was measured [s].
        """
        before, shown = self._before if stamp == self._last[0] else self._last
        if not 0 < stamp - before < RESTART_AFTER:  # another recording, or long before
            shown = np.zeros(6)
        sigmas: np.ndarray = 0.5 * np.hypot(self._sigmas, shown) * elapsed ** 2
        return sigmas

    def note(self, stamp: int, found: Registration, expected: ExpectedPose) -> None:
        """Note what a registration of a frame shows; it may be registered several times."""
        if not found.status.ok or expected.elapsed <= 0.0:
            return
        if stamp != self._last[0]:
            self._before = self._last
        difference = se3.difference(found.T_target_source, expected.T_target_source)
        self._last = stamp, 2.0 * difference / expected.elapsed ** 2
