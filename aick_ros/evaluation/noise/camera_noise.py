# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The noise of an unknown camera, estimated from a recording of anything with surfaces."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from aick_ros.evaluation.noise.depth_noise import DepthNoise, DepthNoiseSamples
from aick_ros.evaluation.noise.pixel_noise import PixelNoise, PixelNoiseSamples
from aick_ros.settings import Settings
from aick_ros.sources import OnDamaged, RgbdSource, raise_damage


@dataclass(frozen=True)
class CameraNoise:
    """
    The noise of both images of a camera.

    :param pairs: of colour images in which keypoints were compared.
    :param pixels: of the keypoints; None where the recording does not tell.
    """

    depth: DepthNoise
    pairs: int
    pixels: PixelNoise | None

    def to_json(self) -> dict[str, Any]:
        """Return what ``json.dumps`` takes: the depth's figures, and ``pixels`` or None."""
        pixels = None if self.pixels is None else dataclasses.asdict(self.pixels)
        return {**dataclasses.asdict(self.depth), 'pixels': pixels}


def estimate_noise(source: RgbdSource, settings: Settings = Settings(),
                   on_progress: Callable[[int], None] = lambda frames: None,
                   on_damaged: OnDamaged = raise_damage) -> CameraNoise:
    """
    Estimate the noise of depth and of keypoints from a recording.

    :param settings: whose detector and range of depths are used, and whose exponents are kept
        where the recording does not tell them.
    :param on_progress: told the number of frames done, after each.
    :raises InputError: where the recording tells nothing about the depth.
    """
    depth, pixels = DepthNoiseSamples(settings.sensor), PixelNoiseSamples(settings)
    for count, frame in enumerate(source.frames(on_damaged), 1):
        depth.add(frame)
        pixels.add(frame)
        on_progress(count)
    return CameraNoise(depth.model(source.name), pixels.pairs, pixels.model())
