# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Motion by another odometry, the wheels' for example, whose noise grows with the motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import seconds
from aick_ros.odometry.motion_term import MotionTerm
from aick_ros.settings import OdometrySettings

Predict = Callable[[int, int], np.ndarray | None]
"""From two stamps [ns] to ``T_camera0_camera1`` by another odometry; None: it has none."""

_PERSISTENCE = 3.0
"""Time for which wheels slip alike [s]; chosen: the time to turn or to cross a carpet."""

_REST = 3.0
"""Largest motion of a camera at rest, by the smallest noise; derived: noise exceeds it rarely."""


def no_odometry(before: int, now: int) -> None:
    """Return that nothing is known of a motion."""


class OtherOdometry:
    """
    Asks another odometry for motions, each once per frame.

    :param settings: how its noise grows.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        self.slipped_since: int | None = None
        """Stamp of the last frame that was measured before it slipped unseen [ns]; None: never."""
        self.configure(settings)
        self.begin(no_odometry)

    def configure(self, settings: OdometrySettings) -> None:
        """Continue with other settings."""
        self._slip, self._least = settings.guess_slip, settings.guess_sigma

    def restart(self) -> None:
        """Continue with frames that are measured anew."""
        self.slipped_since = None

    def begin(self, predict: Predict) -> None:
        """Begin a frame, whose motions a function returns."""
        self._predict = predict
        self._known: dict[tuple[int, int], np.ndarray | None] = {}

    def motion(self, start: int, end: int) -> np.ndarray | None:
        """
        Return ``T_camera0_camera1`` between two stamps [ns], 4x4; None: it is not known.

        :raises InputError: where it is not a rigid transformation.
        """
        if (start, end) not in self._known:
            motion = self._predict(start, end)
            self._known[start, end] = (
                None if motion is None else se3.checked(motion, 'the predicted motion'))
        return self._known[start, end]

    def with_slip(self, motion: np.ndarray) -> PoseWithCovariance:
        """Return a motion, 4x4, with the covariance assumed for it."""
        amount = np.array([np.linalg.norm(motion[:3, 3]), se3.angle(motion[:3, :3])])
        sigmas = np.repeat(self._slip * amount + self._least, 3)
        return PoseWithCovariance(motion, np.diag(sigmas ** 2))

    def term(self, start: int, end: int, is_summed: bool = False) -> MotionTerm | None:
        """
        Return the motion between two stamps [ns] as a measurement; None: it is not known.

        :param is_summed: whether such motions are added up, as independent ones: wheels that slip
            do so for longer.
        """
        motion = self.motion(start, end)
        if motion is None:
            return None
        factor = max(_PERSISTENCE / seconds(start, end), 1.0) if is_summed else 1.0
        return MotionTerm(motion, np.eye(6), factor * self.with_slip(motion).covariance)

    def is_at_rest(self, motion: np.ndarray) -> bool:
        """Return whether a motion, 4x4, is within the smallest noise."""
        largest = max(float(np.linalg.norm(motion[:3, 3])), se3.angle(motion[:3, :3]))
        return largest <= _REST * self._least
