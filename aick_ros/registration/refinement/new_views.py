# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Registrations that show something new of a camera, and those that only repeat what one showed.

A camera at rest off its keyframe sees one pair of views again and again. What this pair shows of
the errors of the camera has an error of its own, the same each time: by their number, and by how
well they agree, such registrations would seem certain.
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros.geometry import se3

_MOVED = 0.005, 0.0044
"""Least motion between two registrations to one frame that are new: 5 mm or 0.25 deg; chosen."""


class NewViews:
    """Distinguishes registrations of a camera that has moved from those of one at rest."""

    def __init__(self) -> None:
        self._target: int | None = None  # its stamp; there is none yet
        self._T_target_source = np.eye(4)

    def add(self, target: int, T_target_source: np.ndarray) -> bool:
        """
        Return whether a registration is of another pair of views than the last new one.

        :param target: stamp of the target [ns].
        :param T_target_source: pose of the source in the target, 4x4.
        """
        if target == self._target and not self._has_moved(T_target_source):
            return False
        self._target, self._T_target_source = target, T_target_source
        return True

    def _has_moved(self, T_target_source: np.ndarray) -> bool:
        motion = se3.inverse(self._T_target_source) @ T_target_source
        shift, angle = _MOVED
        return math.hypot(*motion[:3, 3].tolist()) >= shift or se3.angle(motion[:3, :3]) >= angle
