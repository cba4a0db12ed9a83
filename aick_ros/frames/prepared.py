# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame prepared for registration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Surface


@dataclass(frozen=True, eq=False)
class PreparedFrame:
    """
    One frame with everything that its registrations need, computed once.

    :param grey: colour image in grey, HxW uint8.
    :param surface: surface of the depth image; None if the refinement does not use it.
    :param depth_lag: time from the colour image to the depth image [s].
    :param stamp_jitter: standard deviation of the recent stamps about a constant rate [s].
    :param repeat: images that are those of the frame before.
    """

    frame: RgbdFrame
    keypoints: KeypointFrame
    grey: np.ndarray
    surface: Surface | None = None
    depth_lag: float = 0.0
    stamp_jitter: float = 0.0
    repeat: Repeat = Repeat.NONE

    @property
    def stamp(self) -> int:
        """Stamp of the colour image [ns]."""
        return self.frame.stamp
