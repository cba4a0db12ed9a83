# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth noise of an unknown camera, estimated from smooth surfaces in a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.borders.names import counted
from aick_ros.errors import InputError
from aick_ros.evaluation.noise.noise_law import MIN_SAMPLES, bins_of, fit_law
from aick_ros.evaluation.noise.patch_noise import PatchNoise
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.settings import SensorSettings
from aick_ros.settings.parameter import parameters

_STEP = 16  # spacing of the pixels from which the range of depth is estimated [px]; chosen
_OUTLIERS = 0.1  # share of outliers at each end of the range of depth [%]; chosen


@dataclass(frozen=True)
class DepthBin:
    """
    Noise in a bin of depths.

    :param depth: mean depth of the patches [m].
    :param patches: number of patches.
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
    Noise model sigma = depth_sigma * depth ^ depth_exponent of a camera.

    :param source: name of the recording.
    :param frames: number of frames.
    :param nearest: 0.1 % quantile of the depth [m].
    :param farthest: 99.9 % quantile of the depth [m].
    :param depth_sigma: standard deviation at one metre [m].
    :param exponent_estimated: False where the range of depth is too small to estimate the
        exponent, and that of the settings was kept.
    :param bins: bins with enough patches, by depth.
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
    Collects the noise on smooth surfaces of depth images.

    :param sensor: its range of depth is used, and its exponent where the images do not determine
        one.
    """

    def __init__(self, sensor: SensorSettings = SensorSettings()) -> None:
        self._sensor = sensor
        self._noises: list[PatchNoise] = []
        self._ranges: list[np.ndarray] = []

    def add(self, frame: RgbdFrame) -> None:
        """Add the next frame."""
        self._noises.append(PatchNoise.of(frame.depth, frame.camera, self._sensor))
        sparse = frame.depth[::_STEP, ::_STEP]
        self._ranges.append(sparse[np.isfinite(sparse)])

    def model(self, name: str) -> DepthNoise:
        """
        Return the noise model.

        :param name: name of the recording.
        :raises InputError: without frames, enough smooth surfaces, or any noise.
        """
        if not self._noises:
            raise InputError(f'{name} has no usable frame')
        depths = np.concatenate([noise.depths for noise in self._noises])
        bins = bins_of(depths, np.concatenate([noise.sigmas for noise in self._noises]))
        if not bins:
            raise InputError(
                f'{name}: {len(depths)} patches of smooth surface between '
                f'{self._sensor.min_depth:g} and {self._sensor.max_depth:g} m, in '
                f'{counted(len(self._noises), "frame")}, are too few to estimate the depth noise '
                f'(at least {MIN_SAMPLES} at about the same depth are required): record walls, '
                'floors and tables, with the camera moving slowly, from near and from far')
        declared = {p.name: p for p in parameters(self._sensor)}
        if min(bin_.sigma for bin_ in bins) < (declared['depth_sigma'].minimum or 0.0):
            raise InputError(f'{name}: its depth has no noise; record with a real camera, or '
                             'render without --perfect')
        law = fit_law(bins, self._sensor.depth_exponent, declared['depth_exponent'])
        nearest, farthest = np.percentile(np.concatenate(self._ranges),
                                          (_OUTLIERS, 100 - _OUTLIERS))
        return DepthNoise(
            name, len(self._noises), float(nearest), float(farthest), law.scale, law.exponent,
            law.exponent_estimated, tuple(DepthBin(bin_.at, bin_.count, bin_.sigma,
                                                   law.at(bin_.at)) for bin_ in bins))
