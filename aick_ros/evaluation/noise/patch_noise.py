# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The noise of single depth pixels: what planes leave of small patches of a depth image.

Planes are fitted to the inverse depth, which is linear in the pixel there.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

SIDE = 24
"""Of a patch [px]: many times what neighbouring pixels have in common, little of a surface."""

_BLOCKS = 3  # of a patch, in each direction
_LEAST_PIXELS = 0.9  # share of a patch that has depth, and share of those that its plane explains
_CLIPPED = 3.0  # standard deviations from the plane beyond which a pixel is left out
_CLIPPINGS = 3
_OF_CLIPPED = 0.9866  # standard deviation of a normal distribution cut off there
_STRUCTURE = 0.3  # share of the variance that the means of blocks may have
_SLANTED = 0.5  # cosine between ray and normal: 60 degrees
_SAME = 1e-12  # 1/m; standard deviation where all lies inside one step, which tells nothing


@dataclass(frozen=True, eq=False)
class PatchNoise:
    """
    The noise in patches of one or more depth images, of those on smooth surfaces.

    :param depths: K, of their centres [m].
    :param sigmas: K, standard deviations of one pixel's depth [m].
    """

    depths: np.ndarray
    sigmas: np.ndarray

    @classmethod
    def of(cls, depth: np.ndarray, camera: Camera, sensor: SensorSettings) -> PatchNoise:
        """
        Measure the noise of a depth image.

        Left out are patches with holes, edges, surfaces that a plane does not explain, or seen
        from more than 60 degrees off their normal.

        :param depth: HxW float32 [m], NaN where there is none.
        :param sensor: its range of depths.
        """
        inverse, centres = _patches(depth, sensor)
        known = np.isfinite(inverse)
        full = known.mean(axis=1) >= _LEAST_PIXELS
        inverse, centres, known = inverse[full], centres[full], known[full]
        planes, left, kept = _fit_planes(np.where(known, inverse, 0.0), known)
        count = kept.sum(axis=1)
        variance = (left ** 2).sum(axis=1) / (count - 3)
        with np.errstate(divide='ignore', invalid='ignore'):
            smooth = ((count >= _LEAST_PIXELS * known.sum(axis=1)) & (planes[:, 0] > 0)
                      & (variance > _SAME ** 2)
                      & (_block_variance(left, kept) <= _STRUCTURE * variance)
                      & (_cos_incidence(planes, centres, camera) >= _SLANTED))
        depths = 1.0 / planes[smooth, 0]
        return cls(depths, np.sqrt(variance[smooth]) / _OF_CLIPPED * depths ** 2)


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
    """Return what a plane is linear in at each pixel, SIDE^2 x 3, and its products, x 9."""
    v, u = np.indices((SIDE, SIDE)).reshape(2, -1) - (SIDE - 1) / 2
    design = np.stack([np.ones(SIDE * SIDE), u, v], axis=1)
    return design, np.einsum('pi,pj->pij', design, design).reshape(-1, 9)


def _fit_planes(inverse: np.ndarray,
                known: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """
    Fit planes to patches, without pixels that lie off them.

    :param inverse: PxSIDE^2, finite.
    :param known: PxSIDE^2 bool.
    :returns: value at the centre and derivatives along a row and a column, Px3; what is left of
        each pixel, PxSIDE^2, 0 where it is left out; PxSIDE^2 bool, which are not.
    """
    design, products = _design()
    kept = known
    for _ in range(_CLIPPINGS):
        normal = (kept @ products).reshape(-1, 3, 3)
        planes = np.linalg.solve(normal, ((kept * inverse) @ design)[..., None])[..., 0]
        left = inverse - planes @ design.T
        sigma = np.sqrt(((kept * left) ** 2).sum(axis=1) / kept.sum(axis=1))
        inside = known & (np.abs(left) <= _CLIPPED * sigma[:, None])
        # a patch of which little remains is no plane, and must not become singular
        kept = np.where((inside.mean(axis=1) > 0.5)[:, None], inside, kept)
    return planes, kept * left, kept


def _block_variance(left: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return the mean square of the means of blocks: large where surfaces bend, P."""
    shape = (-1, _BLOCKS, SIDE // _BLOCKS, _BLOCKS, SIDE // _BLOCKS)
    sums, counts = (image.reshape(shape).sum(axis=(2, 4)) for image in (left, kept))
    return ((sums / counts) ** 2).mean(axis=(1, 2))


def _cos_incidence(planes: np.ndarray, centres: np.ndarray, camera: Camera) -> np.ndarray:
    """Return the cosine of the angle between ray and surface normal, P."""
    x, y = camera.normalize(centres).T
    # the plane (a, b, c) . p = 1 has the inverse depth a x + b y + c
    a, b = planes[:, 1] * camera.fx, planes[:, 2] * camera.fy
    c = planes[:, 0] - a * x - b * y
    return planes[:, 0] / np.sqrt((a * a + b * b + c * c) * (x * x + y * y + 1))
