# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The depth noise of an unknown camera, estimated from a recording of anything with surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.errors import InputError
from aick_ros.evaluation.noise.noise_law import LEAST_SAMPLES, bins_of, fit_law
from aick_ros.evaluation.noise.patch_noise import PatchNoise
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.settings import SensorSettings
from aick_ros.settings.parameter import parameters

_STEP = 16  # between the pixels that the range of depths is taken from [px]
_OUTLYING = 0.1  # per cent of the depths, at each end


@dataclass(frozen=True)
class DepthBin:
    """
    The noise at some depths.

    :param depth: mean of the patches [m].
    :param patches: how many.
    :param sigma: median of their standard deviations [m].
    :param model: standard deviation by the model [m].
    """

    depth: float
    patches: int
    sigma: float
    model: float


@dataclass(frozen=True)
class DepthNoise:
    """
    The noise model sigma = depth_sigma * depth ^ depth_exponent of a camera.

    :param source: name of the recording.
    :param frames: it is estimated from.
    :param nearest: depth that a thousandth of the pixels are nearer than [m].
    :param farthest: depth that a thousandth of the pixels are farther than [m].
    :param depth_sigma: at one metre [m].
    :param exponent_estimated: False where the depths span too little to tell the exponent, and
        the one of the settings was kept.
    :param bins: with enough patches, by depth.
    """

    source: str
    frames: int
    nearest: float
    farthest: float
    depth_sigma: float
    depth_exponent: float
    exponent_estimated: bool
    bins: Sequence[DepthBin]


class DepthNoiseSamples:
    """
    Gathers what the smooth surfaces of depth images tell of their noise.

    :param sensor: its range is used, and its exponent where the images do not tell.
    """

    def __init__(self, sensor: SensorSettings = SensorSettings()) -> None:
        self._sensor = sensor
        self._noises: list[PatchNoise] = []
        self._ranges: list[np.ndarray] = []

    def add(self, frame: RgbdFrame) -> None:
        """Take the next frame."""
        self._noises.append(PatchNoise.of(frame.depth, frame.camera, self._sensor))
        sparse = frame.depth[::_STEP, ::_STEP]
        self._ranges.append(sparse[np.isfinite(sparse)])

    def model(self, name: str) -> DepthNoise:
        """
        Return the noise model.

        :param name: of the recording.
        :raises InputError: where there was no frame, too few smooth surfaces, or no noise.
        """
        if not self._noises:
            raise InputError(f'{name} has no frame that can be used')
        depths = np.concatenate([noise.depths for noise in self._noises])
        bins = bins_of(depths, np.concatenate([noise.sigmas for noise in self._noises]))
        if not bins:
            raise InputError(
                f'{name}: {len(depths)} patches of smooth surface between '
                f'{self._sensor.min_depth:g} and {self._sensor.max_depth:g} m, in '
                f'{len(self._noises)} frames, are too few to tell the depth noise '
                f'({LEAST_SAMPLES} at about the same depth): record walls, floors and tables, '
                'slowly, from near and from far')
        declared = {p.name: p for p in parameters(self._sensor)}
        if min(bin_.sigma for bin_ in bins) < declared['depth_sigma'].minimum:
            raise InputError(f'{name}: its depth has no noise; was it rendered without?')
        law = fit_law(bins, declared['depth_exponent'])
        nearest, farthest = np.percentile(np.concatenate(self._ranges),
                                          (_OUTLYING, 100 - _OUTLYING))
        return DepthNoise(
            name, len(self._noises), float(nearest), float(farthest), law.scale, law.exponent,
            law.exponent_estimated, tuple(DepthBin(bin_.at, bin_.count, bin_.sigma,
                                                   law.at(bin_.at)) for bin_ in bins))
