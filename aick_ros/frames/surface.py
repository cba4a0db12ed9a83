# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
The surfaces of a depth image: points with normals on a coarse grid.

Everything is done in inverse depth. There a plane is linear in the pixel, so averaging and
derivatives are exact on it, and the noise of a triangulating camera is the same at all depths.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros.frames.depth import inverse_depth_sigma
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

CELL = 4
"""Side of the cells that are averaged into one point [px]."""

_REACH = 2  # cells to each side that a plane is fitted to
_ROUGHNESS = 8.0  # standard deviations of the depth by which a fit may be off
_GRAZING = 0.17  # cosine between ray and normal; about 80 degrees
_BUCKETS = 8  # of the normals, along x and along y


@dataclass(frozen=True)
class Grid:
    """A pinhole camera without distortion whose pixels are the cells; all in cells."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @property
    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """x of the columns (1xW) and y of the rows (Hx1) on the plane z = 1, float32."""
        x = (np.arange(self.width, dtype=np.float32) - self.cx) / self.fx
        y = (np.arange(self.height, dtype=np.float32) - self.cy) / self.fy
        return np.float32(x)[None], np.float32(y)[:, None]


@dataclass(frozen=True, eq=False)
class Surface:
    """
    Points of a depth image with their normals, in the optical frame of the camera.

    :param grid: where they lie in the image; M = width * height cells, row by row.
    :param points: Mx3 float32 [m].
    :param normals: Mx3 float32, towards the camera's far side (n . p > 0).
    :param usable: M bool: a plane fits there, without an edge, a hole, or a grazing ray.
    :param chosen: K indices of the cells that tell most about a motion.
    """

    grid: Grid
    points: np.ndarray
    normals: np.ndarray
    usable: np.ndarray
    chosen: np.ndarray

    @classmethod
    def of(cls, depth: np.ndarray, camera: Camera, sensor: SensorSettings,
           count: int) -> Surface:
        """
        Find the surfaces of a depth image.

        :param depth: HxW float32 [m], NaN where there is none.
        :param count: cells to choose.
        """
        grid = _grid(camera)
        inverse = _inverse_depth(depth, camera, sensor)
        mean, a, b, roughness = _fit_planes(inverse)
        x, y = grid.rays
        a, b = a * np.float32(grid.fx), b * np.float32(grid.fy)
        with np.errstate(divide='ignore', invalid='ignore'):
            # the plane (a, b, c) . p = 1 has the inverse depth a x + b y + c
            c = mean - a * x - b * y
            steepness = 1.0 / np.sqrt(a * a + b * b + c * c)
            normals = np.stack([a * steepness, b * steepness, c * steepness], axis=-1)
            z = 1.0 / mean
            points = np.stack([x * z, y * z, z], axis=-1)
            slant = steepness * mean / np.sqrt(x * x + y * y + 1)
            smooth = roughness < _ROUGHNESS * inverse_depth_sigma(z, sensor)
            usable = smooth & (slant > _GRAZING)
        normals, usable = normals.reshape(-1, 3), usable.ravel()
        return cls(grid, points.reshape(-1, 3), normals, usable, _choose(normals, usable, count))

    def cells_at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """
        Return where points are seen.

        :param points: Nx3 in the optical frame [m].
        :returns: K indices of the points that are seen on a usable cell, and K of the cells.
        """
        grid = self.grid
        with np.errstate(divide='ignore', invalid='ignore'):
            u = np.rint(points[:, 0] / points[:, 2] * grid.fx + grid.cx)
            v = np.rint(points[:, 1] / points[:, 2] * grid.fy + grid.cy)
        inside = np.flatnonzero((points[:, 2] > 0) & (u >= 0) & (u < grid.width) & (v >= 0)
                                & (v < grid.height))
        cells = (v[inside] * grid.width + u[inside]).astype(np.intp)
        seen = self.usable[cells]
        return inside[seen], cells[seen]


@functools.lru_cache(maxsize=8)
def _grid(camera: Camera) -> Grid:
    centre = (CELL - 1) / 2  # of the first cell [px]
    return Grid(camera.width // CELL, camera.height // CELL, camera.fx / CELL, camera.fy / CELL,
                (camera.cx - centre) / CELL, (camera.cy - centre) / CELL)


@functools.lru_cache(maxsize=8)
def _undistortion(camera: Camera) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the place in the distorted grid of each cell of the pinhole grid; None: the same."""
    if not camera.distortion:
        return None
    grid = _grid(camera)
    x, y = np.broadcast_arrays(*grid.rays)
    rays = np.column_stack([x.ravel(), y.ravel(), np.ones(x.size)])
    pixels = camera.project(rays)
    # beyond the angle up to which the model holds it folds back into the image
    pixels[~(np.abs(camera.normalize(pixels) - rays[:, :2]).max(axis=1) < 1e-2)] = -1e4
    cells = ((pixels - (CELL - 1) / 2) / CELL).astype(np.float32)
    return cv2.convertMaps(cells.reshape(grid.height, grid.width, 2), None, cv2.CV_16SC2)


def _inverse_depth(depth: np.ndarray, camera: Camera, sensor: SensorSettings) -> np.ndarray:
    """Return the mean inverse depth of the cells; NaN where a pixel of the cell has none."""
    grid = _grid(camera)
    inverse = cv2.divide(1.0, depth[:grid.height * CELL, :grid.width * CELL])
    inverse = cv2.resize(inverse, (grid.width, grid.height), interpolation=cv2.INTER_AREA)
    inverse[~((inverse >= 1 / sensor.max_depth)
              & (inverse <= 1 / max(sensor.min_depth, 1e-3)))] = np.nan
    place = _undistortion(camera)
    if place is None:
        return inverse
    return cv2.remap(inverse, *place, cv2.INTER_LINEAR, borderValue=np.nan)


def _fit_planes(inverse: np.ndarray) -> tuple[np.ndarray, ...]:
    """
    Fit a plane around each cell.

    :returns: its value there, its derivatives along a row and a column [per cell], and the root
        mean square of what it leaves; NaN where a cell around has no depth.
    """
    side = 2 * _REACH + 1
    ramp = np.arange(-_REACH, _REACH + 1, dtype=np.float32)
    ones, spread = np.ones(side, np.float32), float((ramp ** 2).sum())
    finite = inverse[np.isfinite(inverse)]
    # the squares of values far from zero would cancel in float32
    level = finite.mean() if len(finite) else np.float32(0)
    centred = inverse - level
    mean = cv2.sepFilter2D(centred, -1, ones / side, ones / side)
    a = cv2.sepFilter2D(centred, -1, ramp / spread, ones / side)
    b = cv2.sepFilter2D(centred, -1, ones / side, ramp / spread)
    square = cv2.sepFilter2D(centred * centred, -1, ones / side, ones / side)
    left = square - mean * mean - (a * a + b * b) * np.float32(spread / side)
    roughness = np.sqrt(np.maximum(left, 0))
    for border in (roughness[:_REACH], roughness[-_REACH:], roughness[:, :_REACH],
                   roughness[:, -_REACH:]):
        border[...] = np.nan
    return mean + level, a, b, roughness


def _choose(normals: np.ndarray, usable: np.ndarray, count: int) -> np.ndarray:
    """
    Choose cells whose normals point in as many directions as there are.

    Each bucket of directions gives up to an equal share, spread over the image, so that a small
    box against a large wall is not outvoted in the direction that only it can tell.
    """
    cells = _shuffled(len(usable))
    cells = cells[usable[cells]]
    if len(cells) <= count:
        return np.sort(cells)
    bucket = ((normals.take(cells, 0)[:, :2] + 1) * (0.5 * _BUCKETS * (1 - 1e-6))).astype(np.int16)
    bucket = bucket[:, 0] * np.int16(_BUCKETS) + bucket[:, 1]
    order = np.argsort(bucket, kind='stable')  # by digits, as 16 bits hold them
    sizes = np.bincount(bucket, minlength=_BUCKETS ** 2)
    rank = np.arange(len(cells)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    # the largest share of which all buckets together need no more than the count
    share = np.partition(rank, count)[count]
    return np.sort(cells[order[rank < share]])


@functools.lru_cache(maxsize=8)
def _shuffled(count: int) -> np.ndarray:
    return np.random.default_rng(0).permutation(count)
