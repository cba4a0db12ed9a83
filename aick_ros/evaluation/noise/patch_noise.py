# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Noise of single depth pixels: residuals of planes fitted to small patches of a depth image.

Planes are fitted to the inverse depth, which on a plane is linear in the pixel coordinates.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

SIDE = 24  # chosen
"""Side of a patch [px]: long against the correlation of neighbours, short against surfaces."""

_BLOCKS = 3  # blocks of a patch, in each direction; chosen
_MIN_SHARE = 0.9  # of a patch's pixels with depth, and of those that are inliers; chosen
_MAX_RESIDUAL = 3.0  # standard deviations of an inlier of a plane; chosen
_ITERATIONS = 3  # of the rejection of outliers; chosen
_CLIPPED_SIGMA = 0.9866  # derived: standard deviation of a normal distribution clipped at 3
_MAX_STRUCTURE = 0.3  # largest share of the variance in the means of the blocks; chosen
_MIN_COSINE = 0.5  # derived: cosine of 60 degrees between ray and normal
_QUANTISED = 1e-12  # [1/m] residuals inside one quantisation step, which hide the noise; chosen


@dataclass(frozen=True, eq=False)
class PatchNoise:
    """
    Noise in the patches of depth images that show a smooth surface.

    :param depths: depth at the centres of the patches, K [m].
    :param sigmas: standard deviation of the depth of one pixel, K [m].
    """

    depths: np.ndarray
    sigmas: np.ndarray

    @classmethod
    def of(cls, depth: np.ndarray, camera: Camera, sensor: SensorSettings) -> PatchNoise:
        """
        Measure the noise of a depth image.

        Patches with holes, depth edges or curved surfaces are ignored, as are surfaces whose
        normal is more than 60 degrees from the ray.

        :param depth: HxW float32 [m], NaN where there is none.
        :param sensor: its range of depth is used.
        """
        inverse, centres = _patches(depth, sensor)
        known = np.isfinite(inverse)
        full = known.mean(axis=1) >= _MIN_SHARE
        inverse, centres, known = inverse[full], centres[full], known[full]
        planes, residuals, inliers = _fit_planes(np.where(known, inverse, 0.0), known)
        count = inliers.sum(axis=1)
        variance = (residuals ** 2).sum(axis=1) / (count - 3)
        with np.errstate(divide='ignore', invalid='ignore'):
            smooth = ((count >= _MIN_SHARE * known.sum(axis=1)) & (planes[:, 0] > 0)
                      & (variance > _QUANTISED ** 2)
                      & (_block_variance(residuals, inliers) <= _MAX_STRUCTURE * variance)
                      & (_cos_incidence(planes, centres, camera) >= _MIN_COSINE))
        depths = 1.0 / planes[smooth, 0]
        return cls(depths, np.sqrt(variance[smooth]) / _CLIPPED_SIGMA * depths ** 2)


def _patches(depth: np.ndarray, sensor: SensorSettings) -> tuple[np.ndarray, np.ndarray]:
    """Return the inverse depths of the patches, PxSIDE^2, and their centres (u, v), Px2 [px]."""
    rows, columns = depth.shape[0] // SIDE, depth.shape[1] // SIDE
    depth = depth[:rows * SIDE, :columns * SIDE].astype(np.float64)
    with np.errstate(divide='ignore', invalid='ignore'):
        used = (depth >= sensor.min_depth) & (depth <= sensor.max_depth) & (depth > 0)
        inverse = np.where(used, 1.0 / depth, np.nan)
    inverse = inverse.reshape(rows, SIDE, columns, SIDE).swapaxes(1, 2)
    centres = np.indices((rows, columns)).reshape(2, -1)[::-1].T * SIDE + (SIDE - 1) / 2
    return inverse.reshape(-1, SIDE * SIDE), centres


@functools.lru_cache(maxsize=1)
def _design() -> tuple[np.ndarray, np.ndarray]:
    """Return the design matrix of a plane, SIDE^2 x 3, and its products, SIDE^2 x 9."""
    v, u = np.indices((SIDE, SIDE)).reshape(2, -1) - (SIDE - 1) / 2
    design = np.stack([np.ones(SIDE * SIDE), u, v], axis=1)
    return design, np.einsum('pi,pj->pij', design, design).reshape(-1, 9)


def _fit_planes(inverse: np.ndarray,
                known: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Fit planes to patches, rejecting outliers.

    :param inverse: PxSIDE^2, finite.
    :param known: PxSIDE^2 bool, pixels with depth.
    :returns: value at the centre and derivatives along a row and a column, Px3; residuals,
        PxSIDE^2, 0 for outliers; inliers, PxSIDE^2 bool.
    """
    design, products = _design()
    inliers = known
    for _ in range(_ITERATIONS):
        normal = (inliers @ products).reshape(-1, 3, 3)
        planes = np.linalg.solve(normal, ((inliers * inverse) @ design)[..., None])[..., 0]
        residuals = inverse - planes @ design.T
        sigma = np.sqrt(((inliers * residuals) ** 2).sum(axis=1) / inliers.sum(axis=1))
        near = known & (np.abs(residuals) <= _MAX_RESIDUAL * sigma[:, None])
        # a patch with few inliers is no plane, and its equations must not become singular
        inliers = np.where((near.mean(axis=1) > 0.5)[:, None], near, inliers)
    return planes, inliers * residuals, inliers


def _block_variance(residuals: np.ndarray, inliers: np.ndarray) -> np.ndarray:
    """Return the mean square of the blocks' mean residuals, P: large on curved surfaces."""
    shape = (-1, _BLOCKS, SIDE // _BLOCKS, _BLOCKS, SIDE // _BLOCKS)
    sums, counts = (image.reshape(shape).sum(axis=(2, 4)) for image in (residuals, inliers))
    variance: np.ndarray = ((sums / counts) ** 2).mean(axis=(1, 2))
    return variance


def _cos_incidence(planes: np.ndarray, centres: np.ndarray, camera: Camera) -> np.ndarray:
    """Return the cosine of the angle between ray and surface normal, P."""
    x, y = camera.normalize(centres).T
    # the plane (a, b, c) . p = 1 has the inverse depth a x + b y + c
    a, b = planes[:, 1] * camera.fx, planes[:, 2] * camera.fy
    c = planes[:, 0] - a * x - b * y
    cosine: np.ndarray = planes[:, 0] / np.sqrt((a * a + b * b + c * c) * (x * x + y * y + 1))
    return cosine
