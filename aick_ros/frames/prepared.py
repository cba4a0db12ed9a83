# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A frame prepared for registration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion
from aick_ros.frames.keypoints import KeypointFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.frames.sharpness import Sharpness
from aick_ros.frames.surface import Surface
from aick_ros.geometry.median import median
from aick_ros.settings import PreparationSettings


@dataclass(frozen=True, eq=False)
class PreparedFrame:
    """
    One frame with everything that its registrations need, computed once.

    :param frame: with its depth image free of the distortion.
    :param grey: colour image in grey, HxW uint8.
    :param surface: surface of the depth image; None if the refinement does not use it.
    :param depth_lag: time from the colour image to the depth image [s].
    :param stamp_jitter: standard deviation of the recent stamps about a constant rate [s]; None
        where there were too few to show any.
    :param clock_correction: of the stamp to the acquisition time, by their rate [s]; zero where
        that is not known.
    :param repeat: images that are those of the frame before.
    :param twist: body velocity (vx, vy, vz, wx, wy, wz) of the camera [m/s, rad/s]; None where
        unknown.
    :param twist_variances: 6, of the errors of the twist [m^2/s^2, rad^2/s^2]; None where they
        are unknown: it counts as exact.
    :param is_tracked: whether the keypoints are not its own, but those of another frame that were
        tracked into it.
    :param distortion: that the depth image is free of.
    :param settings: by which keypoints and surface were made; None: those of whoever registers it.
    """

    frame: RgbdFrame
    keypoints: KeypointFrame
    grey: np.ndarray
    surface: Surface | None = None
    depth_lag: float = 0.0
    stamp_jitter: float | None = 0.0
    repeat: Repeat = Repeat.NONE
    twist: np.ndarray | None = None
    twist_variances: np.ndarray | None = None
    is_tracked: bool = False
    distortion: DepthDistortion = NO_DISTORTION
    settings: PreparationSettings | None = None
    clock_correction: float = 0.0

    @cached_property
    def scene_depth(self) -> float:
        """Median depth of the keypoints, or of the surface where there are none [m]."""
        positions = self.keypoints.positions
        if not len(positions) and self.surface is not None:
            positions = self.surface.points.take(self.surface.chosen, 0)
        return median(positions[:, 2]) if len(positions) else math.nan

    @property
    def stamp(self) -> int:
        """Stamp of the colour image [ns]."""
        return self.frame.stamp

    @cached_property
    def sharpness(self) -> Sharpness:
        """Sharpness of the colour image; measured only where it is asked for."""
        return Sharpness.of(self.grey)

    def moving(self, twist: np.ndarray,
               variances: np.ndarray | None = None) -> PreparedFrame:
        """Return the frame with a velocity, and with all that is known of its images."""
        return self._with(twist=twist, twist_variances=variances)

    def with_keypoints(self, keypoints: KeypointFrame, is_tracked: bool) -> PreparedFrame:
        """Return the frame with other keypoints, and with all that is known of its image."""
        changed = self._with(keypoints=keypoints, is_tracked=is_tracked)
        vars(changed).pop('scene_depth', None)
        return changed

    def bare(self) -> PreparedFrame:
        """Return the frame with the images that registrations need: grey, and depth."""
        return self._with(frame=replaced(self.frame, colour=self.grey, imu=None))

    def _with(self, **changes: Any) -> PreparedFrame:
        """Return the frame with other values of some fields, and what is cached of the others."""
        changed = object.__new__(PreparedFrame)
        vars(changed).update(vars(self), **changes)
        return changed

    def is_blurred_beside(self, other: PreparedFrame) -> bool:
        """
        Return whether the image is blurred beyond use, if that of another frame is not.

        Those of two sizes are not compared: one that was enlarged has less detail.
        """
        return (self.grey.shape == other.grey.shape
                and self.sharpness.is_blurred_beside(other.sharpness))
