# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth at keypoints: sub-pixel sampling that respects edges, and the sensor's noise."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings


def sample(image: np.ndarray, pixels: np.ndarray, sensor: SensorSettings) -> np.ndarray:
    """
    Return the depth at sub-pixel positions.

    Between four pixels on one surface the inverse depth is interpolated, which is exact on a
    plane. Where one of the four has no depth or they lie on both sides of an edge, the nearest
    pixel is taken as it is: a value between two surfaces would be on neither.

    :param image: HxW float32 [m], NaN where there is none.
    :param pixels: Nx2 (u, v) [px].
    :returns: N float64 [m], NaN where there is none or it is out of the sensor's range.
    """
    height, width = image.shape
    u, v = np.asarray(pixels, np.float64).reshape(-1, 2).T
    nearest = image[np.clip(np.rint(v).astype(np.intp), 0, height - 1),
                    np.clip(np.rint(u).astype(np.intp), 0, width - 1)].astype(np.float64)
    column = np.clip(np.floor(u).astype(np.intp), 0, width - 2)
    row = np.clip(np.floor(v).astype(np.intp), 0, height - 2)
    right, down = np.clip(u - column, 0.0, 1.0), np.clip(v - row, 0.0, 1.0)
    corners = np.stack([image[row, column], image[row, column + 1],
                        image[row + 1, column], image[row + 1, column + 1]]).astype(np.float64)
    weights = np.stack([(1 - right) * (1 - down), right * (1 - down),
                        (1 - right) * down, right * down])
    with np.errstate(divide='ignore', invalid='ignore'):
        interpolated = 1.0 / (weights / corners).sum(axis=0)
        smooth = np.ptp(corners, axis=0) <= sensor.depth_jump * corners.min(axis=0)
        depths = np.where(smooth, interpolated, nearest)
        usable = (depths >= sensor.min_depth) & (depths <= sensor.max_depth)
    return np.where(usable, depths, np.nan)


def inverse_depth_sigma(z: np.ndarray, sensor: SensorSettings) -> np.ndarray | float:
    """Return the standard deviation of the inverse of some depths [1/m], or the one of all."""
    if sensor.depth_exponent == 2.0:
        return sensor.depth_sigma
    return sensor.depth_sigma * z ** (sensor.depth_exponent - 2.0)


def position_covariances(positions: np.ndarray, pixel_sigmas: np.ndarray, camera: Camera,
                         sensor: SensorSettings) -> np.ndarray:
    """
    Return the covariance of back-projected points.

    Pixel noise and depth noise are independent; the depth's grows with a power of the depth, its
    square where it is triangulated (Khoshelham and Elberink 2012).

    :param positions: Nx3 in the optical frame [m].
    :param pixel_sigmas: N, standard deviation in the image [px].
    :returns: Nx3x3 [m^2].
    """
    z = positions[:, 2]
    sigmas = inverse_depth_sigma(z, sensor) * z ** 2
    along = positions / np.maximum(z, 1e-9)[:, None] * sigmas[:, None]
    covariances = along[:, :, None] * along[:, None, :]
    covariances[:, 0, 0] += (pixel_sigmas * z / camera.fx) ** 2
    covariances[:, 1, 1] += (pixel_sigmas * z / camera.fy) ** 2
    return covariances
