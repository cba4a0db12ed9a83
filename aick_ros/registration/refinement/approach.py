# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
An expected pose, brought near the right one before all keypoints are tracked.

Where a camera turns as it was not expected to, keypoints are far from where they are sought. A few
of them, sought from the coarsest level of the images on, show by how much. Then the others are
sought from nearby, at full resolution alone (two stages, as Klein and Murray 2007 track).
"""

from __future__ import annotations

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import definite, se3
from aick_ros.registration.refinement.residuals import PRIOR, track_equations
from aick_ros.registration.refinement.tracks import FEWEST_TO_CONFIRM, Tracker
from aick_ros.settings import RefinementSettings, SensorSettings

_COUNT = 60  # chosen: keypoints that are tracked at first
_WIDTHS = 3.0, 1.0, 1.0
"""Robust widths of the steps to the pose, as ratios to that of the settings. Chosen."""


class Approach:
    """Brings poses near by a few keypoints."""

    def __init__(self, tracker: Tracker, settings: RefinementSettings,
                 sensor: SensorSettings) -> None:
        self._tracker = tracker
        self._settings = settings
        self._sensor = sensor

    def nearer(self, source: PreparedFrame, target: PreparedFrame,
               T_target_source: np.ndarray) -> np.ndarray | None:
        """
        Return a pose by a few keypoints of the target; None where too few of them are found.

        :param T_target_source: expected, 4x4.
        """
        tracks = self._tracker.track_few(target, source, se3.inverse(T_target_source), _COUNT)
        if len(tracks) < FEWEST_TO_CONFIRM:
            return None
        pose = se3.inverse(T_target_source)
        ray_sigma = self._settings.track_sigma / source.frame.camera.fx
        for width in _WIDTHS:
            equations = track_equations(tracks, pose, ray_sigma, self._sensor,
                                        width * self._settings.robust_width, 1.0)
            pose = se3.perturbed(
                pose, -definite.solve(equations.information + PRIOR, equations.gradient))
        return se3.inverse(pose)
