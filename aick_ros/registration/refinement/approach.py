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
from aick_ros.geometry import se3
from aick_ros.registration.refinement.residuals import PRIOR, NormalEquations, track_steps
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.registration.tracks import FEWEST_TO_CONFIRM, Tracks
from aick_ros.settings import RefinementSettings, SensorSettings

_COUNT = 60  # chosen: keypoints that are tracked at first
_NEAR = 3.0  # px; chosen: error of those that are sought at full resolution alone
_SHARE_NEAR = 0.5  # chosen: share of the tracks that confirm a pose
_WIDER = 3.0, 1.0, 1.0
"""Robust widths of the steps to the pose, as ratios to that of the settings. Chosen."""


class Approach:
    """Brings poses near by a few keypoints."""

    def __init__(self, tracker: Tracker, settings: RefinementSettings,
                 sensor: SensorSettings) -> None:
        self._tracker = tracker
        self._track_sigma = settings.track_sigma
        self._width = settings.robust_width
        self._sensor = sensor

    def nearer(self, source: PreparedFrame, target: PreparedFrame,
               T_target_source: np.ndarray) -> np.ndarray | None:
        """
        Return a pose by a few keypoints of the target; None where too few of them agree with it.

        :param T_target_source: expected, 4x4.
        """
        first = se3.inverse(T_target_source)
        tracks = self._tracker.track_few(target, source, first, _COUNT)
        if len(tracks) < FEWEST_TO_CONFIRM:
            return None
        pose, _ = track_steps(
            tracks, first, self._track_sigma / source.frame.camera.fx, self._sensor, self._width,
            _WIDER, 1.0, NormalEquations.of((), PRIOR))
        return se3.inverse(pose) if self._agree(tracks, pose, source) else None

    @staticmethod
    def _agree(tracks: Tracks, T_source_target: np.ndarray, source: PreparedFrame) -> bool:
        """Return whether most tracks, and enough of them, are where a pose puts them."""
        near = tracks.count_near(T_source_target, _NEAR / source.frame.camera.fx)
        return near >= max(FEWEST_TO_CONFIRM, _SHARE_NEAR * len(tracks))
