# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Imperfections of a Kinect-like camera, added to perfect images."""

from __future__ import annotations

import statistics
from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera

_QUANTILES = 4096
_NORMAL = np.array([statistics.NormalDist().inv_cdf((i + 0.5) / _QUANTILES)
                    for i in range(_QUANTILES)], np.float32)


@dataclass(frozen=True)
class ColourSensor:
    """
    Imperfections of the colour image; 0 switches one off.

    :param sigma: standard deviation of the noise [grey levels].
    :param shutter: exposure time, with the stamp in its middle [s].
    :param exposure_swing: amplitude of the automatic exposure's gain (0.15: 15 %).
    :raises InputError: where one is negative.
    """

    sigma: float = 2.0
    shutter: float = 0.008
    exposure_swing: float = 0.15

    def __post_init__(self) -> None:
        """Reject negative numbers."""
        _reject_negative('colour', self)

    @classmethod
    def perfect(cls) -> ColourSensor:
        """Return a sensor without imperfections."""
        return cls(sigma=0.0, shutter=0.0, exposure_swing=0.0)

    def measure(self, colour: np.ndarray, gain: float, rng: np.random.Generator) -> np.ndarray:
        """
        Return the image that the sensor measures.

        :param colour: HxWx3 uint8.
        :param gain: of the exposure.
        :returns: HxWx3 uint8.
        """
        if gain != 1.0:
            colour = cv2.convertScaleAbs(colour, alpha=gain)
        if self.sigma > 0:
            noise = self.sigma * _normal(rng, colour.shape)
            colour = cv2.add(colour, noise, dtype=cv2.CV_8U)
        return colour


@dataclass(frozen=True)
class DepthSensor:
    """
    Imperfections of the depth image, which is triangulated from a projected pattern.

    Noise and quantisation are those of the disparity, so they grow with the square of the depth;
    the numbers are for a depth of one metre. The projector is to the right of the camera, so that
    objects throw a shadow to their left in which there is no depth.

    :param sigma: standard deviation of the noise at one metre [m]; 0: none.
    :param grain: correlation length of the noise [px]; 0: independent pixels.
    :param step: of the quantisation at one metre [m]; 0: none.
    :param edge_jitter: standard deviation of the pixel whose depth is measured [px]; 0: none.
    :param baseline: distance from the camera to the projector [m]; 0: no shadows.
    :param max_incidence: largest incidence angle with depth [rad]; pi / 2: no limit.
    :param min_depth: smallest depth that is measured [m]; 0: no limit.
    :param max_depth: largest depth that is measured [m]; inf: no limit.
    :raises InputError: where one is negative.
    """

    sigma: float = 0.0013
    grain: float = 1.0
    step: float = 0.0029
    edge_jitter: float = 0.5
    baseline: float = 0.075
    max_incidence: float = 1.4
    min_depth: float = 0.5
    max_depth: float = 5.0

    def __post_init__(self) -> None:
        """Reject negative numbers."""
        _reject_negative('depth', self)

    @classmethod
    def perfect(cls) -> DepthSensor:
        """Return a sensor without imperfections."""
        return cls(sigma=0.0, grain=0.0, step=0.0, edge_jitter=0.0, baseline=0.0,
                   max_incidence=np.pi / 2, min_depth=0.0, max_depth=np.inf)

    def measure(self, depth: np.ndarray, camera: Camera, rng: np.random.Generator) -> np.ndarray:
        """
        Return the depth image that the sensor measures.

        :param depth: HxW float32 [m], NaN where there is none.
        :param camera: of the image.
        :returns: HxW float32 [m], NaN where there is none.
        """
        inverse: np.ndarray = 1 / depth
        missing = self._missing(depth, inverse, camera)
        if self.edge_jitter > 0:
            pixels = _jittered_pixels(self.edge_jitter, depth.shape, rng)
            inverse = cv2.remap(inverse, *pixels, cv2.INTER_NEAREST,
                                borderMode=cv2.BORDER_REPLICATE)
            missing = cv2.remap(missing.astype(np.uint8), *pixels, cv2.INTER_NEAREST,
                                borderMode=cv2.BORDER_REPLICATE) > 0
        if self.sigma > 0:
            inverse += self.sigma * _grained(_normal(rng, depth.shape), self.grain)
        if self.step > 0:
            inverse = np.rint(inverse / np.float32(self.step)) * np.float32(self.step)
        with np.errstate(divide='ignore'):
            measured = 1 / inverse
        measured[missing | ~(inverse > 0)] = np.nan
        return measured

    def _missing(self, depth: np.ndarray, inverse: np.ndarray, camera: Camera) -> np.ndarray:
        missing = ~((depth >= self.min_depth) & (depth <= self.max_depth))
        if self.baseline > 0:
            missing |= _shadow(inverse, self.baseline * camera.fx)
        if self.max_incidence < np.pi / 2:
            missing |= _cos_incidence(inverse, camera) < np.cos(self.max_incidence)
        return missing


def _shadow(inverse: np.ndarray, disparity: float) -> np.ndarray:
    """Return the pixels that a projector to the right does not reach, HxW bool."""
    columns = np.arange(inverse.shape[1], dtype=np.float32)
    seen_at = np.nan_to_num(columns - np.float32(disparity) * inverse, nan=np.inf)
    farthest_left = np.minimum.accumulate(seen_at[:, ::-1], axis=1)[:, ::-1]
    shadow = np.zeros(inverse.shape, bool)
    # differences up to a pixel are rounding
    shadow[:, :-1] = seen_at[:, :-1] > farthest_left[:, 1:] + 1
    return shadow


def _cos_incidence(inverse: np.ndarray, camera: Camera) -> np.ndarray:
    """Return the cosine of the angle between ray and surface normal, HxW."""
    # on a plane the inverse depth is linear in the pixel: a x + b y + c, with normal (a, b, c)
    kernel = np.array([[-0.5, 0, 0.5]], np.float32)
    a = cv2.filter2D(inverse, -1, kernel, borderType=cv2.BORDER_REPLICATE) * np.float32(camera.fx)
    b = cv2.filter2D(inverse, -1, kernel.T, borderType=cv2.BORDER_REPLICATE) * np.float32(
        camera.fy)
    x = ((np.arange(camera.width) - camera.cx) / camera.fx).astype(np.float32)
    y = ((np.arange(camera.height) - camera.cy) / camera.fy).astype(np.float32)[:, None]
    c = inverse - a * x - b * y
    cosine: np.ndarray = inverse / np.sqrt((a * a + b * b + c * c) * (x * x + y * y + 1))
    return cosine


def _jittered_pixels(sigma: float, shape: tuple[int, int],
                     rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    rows, columns = np.indices(shape, np.float32)
    scale = np.float32(sigma)
    return columns + scale * _normal(rng, shape), rows + scale * _normal(rng, shape)


def _normal(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return standard normal numbers, float32, much faster than the generator."""
    return _NORMAL.take(rng.integers(0, _QUANTILES, shape, np.uint16))


def _grained(noise: np.ndarray, grain: float) -> np.ndarray:
    """Smooth noise over some pixels and keep its standard deviation."""
    if grain == 0.0:
        return noise
    kernel: np.ndarray = cv2.getGaussianKernel(2 * int(np.ceil(3 * grain)) + 1, grain)
    kernel /= np.linalg.norm(kernel)
    return cv2.sepFilter2D(noise, -1, kernel, kernel, borderType=cv2.BORDER_REFLECT_101)


def _reject_negative(name: str, sensor: ColourSensor | DepthSensor) -> None:
    for parameter, value in vars(sensor).items():
        if not value >= 0:
            raise InputError(f'{name} sensor: {parameter} is {value:g}: it must be 0 or more')
