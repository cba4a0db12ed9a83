# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What registrations need of one frame, made once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.surface import Surface


@dataclass(frozen=True, eq=False)
class PreparedFrame:
    """
    One frame, ready to be registered.

    :param grey: HxW uint8.
    :param surface: of the depth image; None where the refinement does not use it.
    :param depth_lag: how much later than the colour image the depth image was taken [s].
    :param stamp_jitter: standard deviation of the stamps up to here about a steady rate [s].
    """

    frame: RgbdFrame
    keypoints: KeypointFrame
    grey: np.ndarray
    surface: Surface | None = None
    depth_lag: float = 0.0
    stamp_jitter: float = 0.0

    @property
    def stamp(self) -> int:
        """Of the colour image [ns]."""
        return self.frame.stamp
