# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Noise and misalignment of the colour and depth images of an unknown camera."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from aick_ros.evaluation.noise.depth_noise import DepthNoise, DepthNoiseSamples
from aick_ros.evaluation.noise.pixel_noise import PixelNoise, PixelNoiseSamples
from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion
from aick_ros.frames.mask import mask_of
from aick_ros.odometry import Odometry
from aick_ros.settings import MisalignmentSettings, Settings
from aick_ros.sources import OnDamaged, RgbdSource, raise_damage


@dataclass(frozen=True)
class CameraNoise:
    """
    Noise of both images of a camera, and their misalignment.

    :param pairs: number of pairs of colour images in which keypoints were compared.
    :param pixels: noise of the keypoints; None where there is too little data.
    :param misalignment: that of the settings, with each deviation that is certain.
    :param distortion: of the depth images, where it is significant.
    """

    depth: DepthNoise
    pairs: int
    pixels: PixelNoise | None
    misalignment: MisalignmentSettings
    distortion: DepthDistortion = NO_DISTORTION

    def to_json(self) -> dict[str, Any]:
        """Return the content of the JSON: of depth, keypoints and both images."""
        pixels = None if self.pixels is None else dataclasses.asdict(self.pixels)
        return {**dataclasses.asdict(self.depth), 'pixels': pixels,
                'misalignment': dataclasses.asdict(self.misalignment),
                'distortion': self.distortion.nodes.tolist()}


def estimate_noise(source: RgbdSource, settings: Settings = Settings(),
                   on_progress: Callable[[int], None] = lambda frames: None,
                   on_damaged: OnDamaged = raise_damage) -> CameraNoise:
    """
    Estimate the noise of depth and of keypoints from a recording, and follow it by odometry.

    :param settings: of the odometry; its exponents and misalignment are kept where the recording
        does not determine them.
    :param on_progress: called after each frame with the number of frames done.
    :raises InputError: where the recording does not determine the depth noise.
    """
    depth, pixels = DepthNoiseSamples(settings.sensor), PixelNoiseSamples(settings)
    mask = mask_of(settings.sensor)
    odometry = Odometry(dataclasses.replace(settings, sensor=settings.sensor.without_mask))
    for count, frame in enumerate(source.frames(on_damaged), 1):
        seen = frame if mask is None else mask.applied(frame)
        depth.add(seen)
        pixels.add(seen)
        odometry.register_frame(seen)
        on_progress(count)
    return CameraNoise(depth.model(source.name), pixels.pairs, pixels.model(),
                       odometry.misalignment.settings, odometry.distortion)
