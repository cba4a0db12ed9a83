# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The depth noise of an unknown camera, estimated from a recording of anything with surfaces."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aick_ros.errors import InputError
from aick_ros.evaluation.patch_noise import PatchNoise
from aick_ros.evaluation.power_law import fit_exponent, fit_scale
from aick_ros.parameter import Parameter, parameters
from aick_ros.settings import SensorSettings
from aick_ros.sources import OnDamaged, RgbdSource, raise_damage

_BINS = 4  # each time the depth doubles
_LEAST_PATCHES = 30  # of a bin
_MOST_PATCHES = 300  # of a bin, that count
_LEAST_SPAN = 2.0  # farthest by nearest bin: less, and a scene decides on the exponent
_LEAST_BINS = 4
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

    def to_json(self) -> dict[str, Any]:
        """Return what ``json.dumps`` takes."""
        return dataclasses.asdict(self)


def estimate_depth_noise(source: RgbdSource, sensor: SensorSettings = SensorSettings(),
                         on_progress: Callable[[int], None] = lambda frames: None,
                         on_damaged: OnDamaged = raise_damage) -> DepthNoise:
    """
    Estimate the depth noise from all smooth surfaces of a recording.

    :param sensor: its range is used, and its exponent where the recording does not tell.
    :param on_progress: told the number of frames done, after each.
    :raises InputError: where the recording has no frame, too few smooth surfaces, or no noise.
    """
    noises, ranges = [], []
    for frame in source.frames(on_damaged):
        noises.append(PatchNoise.of(frame.depth, frame.camera, sensor))
        sparse = frame.depth[::_STEP, ::_STEP]
        ranges.append(sparse[np.isfinite(sparse)])
        on_progress(len(noises))
    if not noises:
        raise InputError(f'{source.name} has no frame that can be used')
    depths = np.concatenate([noise.depths for noise in noises])
    sigmas = np.concatenate([noise.sigmas for noise in noises])
    bins = _bins(depths, sigmas)
    if not bins:
        raise InputError(
            f'{source.name}: {len(depths)} patches of smooth surface in {len(noises)} frames are '
            f'too few to tell the depth noise ({_LEAST_PATCHES} at about the same depth): record '
            'walls, floors and tables, slowly, from near and from far')
    if min(sigma for _, _, sigma in bins) < _declared('depth_sigma').minimum:
        raise InputError(f'{source.name}: its depth has no noise; was it rendered without?')
    nearest, farthest = np.percentile(np.concatenate(ranges), (_OUTLYING, 100 - _OUTLYING))
    return _model(bins, sensor, source.name, len(noises), (float(nearest), float(farthest)))


def _bins(depths: np.ndarray, sigmas: np.ndarray) -> list[tuple[float, int, float]]:
    """Return mean depth, number of patches and median noise of each bin that has enough."""
    found = []
    numbers = np.floor(_BINS * np.log2(depths)).astype(np.intp)
    for number in np.unique(numbers):
        inside = numbers == number
        if inside.sum() >= _LEAST_PATCHES:
            found.append((float(np.exp(np.log(depths[inside]).mean())), int(inside.sum()),
                          float(np.median(sigmas[inside]))))
    return found


def _model(bins: Sequence[tuple[float, int, float]], sensor: SensorSettings, source: str,
           frames: int, range_of_depths: tuple[float, float]) -> DepthNoise:
    depths, patches, sigmas = map(np.array, zip(*bins))
    # beyond some number of patches it is the surfaces that a bin is off by
    weights = np.minimum(patches, _MOST_PATCHES)
    exponent = sensor.depth_exponent
    told = bool(len(bins) >= _LEAST_BINS and depths[-1] >= _LEAST_SPAN * depths[0])
    if told:
        limits = _declared('depth_exponent')
        exponent = min(max(fit_exponent(depths, sigmas, weights), limits.minimum), limits.maximum)
    scale = fit_scale(depths, sigmas, weights, exponent)
    return DepthNoise(source, frames, *range_of_depths, scale, exponent, told, tuple(
        DepthBin(depth, count, sigma, scale * depth ** exponent)
        for depth, count, sigma in bins))


def _declared(name: str) -> Parameter:
    """Return what the settings say of a parameter of the sensor."""
    return next(p for p in parameters(SensorSettings) if p.name == name)
