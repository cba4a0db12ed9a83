# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth at keypoints: sub-pixel sampling that preserves edges, occlusion, and the noise model."""

from __future__ import annotations

import numpy as np

from aick_ros import kernels
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.median import median
from aick_ros.settings import SensorSettings

LEAST_RISE = 0.1  # chosen
"""Ratio by which the inverse depth rises at least at the edge of another surface."""

UNITS_OF_DEPTH = 'images of 32FC1 must be in metres, of 16UC1 in millimetres'
"""End of the sentence about depth that is out of the range of the sensor."""

_LEAST_SHARE = 0.01  # chosen: share of the pixels with depth that lie in the range of the sensor
_STRIDE = 4  # chosen: every fourth row and column shows as much

_LEAST_STEP = 0.5  # chosen: share of the rise within a pixel; at a crease it is spread over all


def sample(image: np.ndarray, pixels: np.ndarray, sensor: SensorSettings) -> np.ndarray:
    """
    Return the depth at sub-pixel positions.

    Between four pixels of one surface the inverse depth is interpolated bilinearly, which is exact
    on a plane. If one of the four has no depth or an edge lies between them, the depth of the
    nearest pixel is returned: an interpolated value would lie on neither surface.

    :param image: HxW float32 [m], NaN where invalid.
    :param pixels: Nx2 (u, v) [px].
    :returns: N float64 [m], NaN where invalid or outside of the range of the sensor.
    """
    depths = np.empty(len(pixels))
    kernels.sample_depth(image, pixels, sensor.depth_jump, sensor.min_depth, sensor.max_depth,
                         depths)
    return depths


def shortage(image: np.ndarray, sensor: SensorSettings) -> str:
    """
    Return why hardly any depth of an image is in the range of the sensor, '' where enough is.

    :param image: HxW float32 [m], NaN where invalid.
    """
    depths = image[::_STRIDE, ::_STRIDE]
    depths = depths[np.isfinite(depths)]
    if not len(depths):
        return 'no pixel of the depth image has depth'
    if np.mean((depths >= sensor.min_depth) & (depths <= sensor.max_depth)) >= _LEAST_SHARE:
        return ''
    return (f'depth is {median(depths):.3g} m in the median, outside of sensor.min_depth '
            f'{sensor.min_depth:g} m to sensor.max_depth {sensor.max_depth:g} m: '
            f'{UNITS_OF_DEPTH}')


def nearer_beside(image: np.ndarray, pixels: np.ndarray, depths: np.ndarray,
                  reach: int) -> np.ndarray:
    """
    Return the depths of surfaces that end beside pixels, N [m]; NaN where there is none.

    They are in front of what the pixel shows: an edge in the colour image there is their edge, and
    moves with them. It is a step in inverse depth that no plane through the pixel explains: on a
    plane, two pixels that are opposite each other are in the mean as near as the one between them.

    :param image: HxW float32 [m], NaN where invalid.
    :param pixels: Nx2 (u, v) [px].
    :param depths: N, at these pixels [m].
    :param reach: distance at which they are sought [px].
    """
    nearer = np.empty(len(depths))
    kernels.nearer_beside(image, pixels, depths, reach, LEAST_RISE, _LEAST_STEP, nearer)
    return nearer


def filled(image: np.ndarray) -> np.ndarray:
    """
    Return a depth image whose holes are a pixel smaller, HxW float32 [m], NaN where invalid.

    A pixel without depth is on the nearest of the surfaces beside it. At the edge of a surface in
    front of another one many sensors have no depth; what the colour image shows there is its edge.

    :param image: HxW float32 [m], NaN where invalid.
    """
    result = np.empty_like(image)
    kernels.filled_depth(image, result)
    return result


def inverse_depth_sigma(z: np.ndarray, sensor: SensorSettings) -> np.ndarray | float:
    """Return the standard deviation of the inverse depth [1/m], one number if it is constant."""
    exponent = sensor.inverse_depth_exponent
    return sensor.depth_sigma if exponent == 0.0 else sensor.depth_sigma * z ** exponent


def noise(sensor: SensorSettings, factor: float = 1.0) -> np.ndarray:
    """Return some times the noise of the inverse depth, as the kernels take it, 2."""
    return np.array([factor * sensor.depth_sigma, sensor.inverse_depth_exponent])


def position_covariances(positions: np.ndarray, pixel_sigmas: np.ndarray, camera: Camera,
                         sensor: SensorSettings) -> np.ndarray:
    """
    Return the covariances of back-projected points.

    Pixel noise and depth noise are independent. The standard deviation of the depth is a power of
    the depth, its square for triangulating sensors (Khoshelham and Elberink 2012).

    :param positions: Nx3 in the optical frame [m].
    :param pixel_sigmas: N, standard deviations of the pixels, in u and in v [px].
    :returns: Nx3x3 [m^2].
    """
    z = positions[:, 2]
    sigmas = inverse_depth_sigma(z, sensor) * z ** 2
    along_ray = positions / np.maximum(z, 1e-9)[:, None] * sigmas[:, None]
    covariances: np.ndarray = along_ray[:, :, None] * along_ray[:, None, :]
    covariances[:, 0, 0] += (pixel_sigmas * z / camera.fx) ** 2
    covariances[:, 1, 1] += (pixel_sigmas * z / camera.fy) ** 2
    return covariances
