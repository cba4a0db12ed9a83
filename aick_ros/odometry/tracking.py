# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames without keypoints of their own, between those that AICK registers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.odometry.attempts import Attempt, Attempts
from aick_ros.odometry.keyframe_choice import KeyframeChoice
from aick_ros.odometry.reference import References
from aick_ros.odometry.velocity import Velocity
from aick_ros.registration.preparation import Preparation
from aick_ros.registration.registrar import Registrar
from aick_ros.settings import Settings


class Tracked(NamedTuple):
    """
    A frame after it was tracked from the keyframe.

    :param prepared: the frame, with keypoints of its own where AICK has to register it.
    :param attempt: by which it is registered; None: AICK has to.
    :param rough: its pose in the keyframe, 4x4, where AICK is to begin; None: there is none.
    """

    prepared: PreparedFrame
    attempt: Attempt | None = None
    rough: np.ndarray | None = None


class Tracking:
    """
    Registers frames by keypoints that are tracked from the keyframe into them.

    Every few frames, and where the keyframe will be replaced, AICK checks the pose.
    """

    def __init__(self) -> None:
        self.restart()

    def configure(self, settings: Settings, registrar: Registrar, attempts: Attempts,
                  keyframes: KeyframeChoice) -> None:
        """Continue with other settings and parts."""
        self._interval = settings.odometry.aick_interval
        self._registrar, self._attempts, self._keyframes = registrar, attempts, keyframes

    def restart(self) -> None:
        """Count the frames from here on, as AICK has registered this one."""
        self._unchecked = 0

    @property
    def is_used(self) -> bool:
        """Frames are tracked at all."""
        return self._interval > 1

    def register(self, preparation: Preparation, references: References,
                 velocity: Velocity) -> Tracked:
        """Return a frame with its registration to the keyframe, unless AICK has to decide."""
        prepared, attempt = self._attempts.by_tracking(
            self._registrar.prepared_for_tracking(preparation), references, velocity)
        if attempt is None or not attempt.status.ok:
            return Tracked(
                self._registrar.with_own_keypoints(prepared),
                rough=attempt.seen.T_target_source if attempt and attempt.seen.is_rough else None)
        self._unchecked += 1
        if self._unchecked >= self._interval or self._keyframes.replaces(prepared, attempt):
            own = self._registrar.with_own_keypoints(prepared)
            if self._registrar.contradicts(own, attempt.reference.prepared,
                                           attempt.seen.T_target_source):
                return Tracked(own)
            self._unchecked = 0
        return Tracked(prepared, attempt)
