# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Cells of a depth image, without the distortion of the camera."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from aick_ros import kernels
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

_MAX_ROUND_TRIP_ERROR = 1e-2  # chosen: on the plane z = 1; beyond it the model folded the ray back
_MIN_DEPTH = 1e-3  # chosen: [m], keeps the inverse depth finite


@dataclass(frozen=True)
class Grid:
    """Undistorted pinhole camera whose pixels are the cells; all values in cells."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    @functools.cached_property
    def intrinsics(self) -> np.ndarray:
        """The focal lengths and the centre: fx, fy, cx, cy."""
        return np.array([self.fx, self.fy, self.cx, self.cy], np.float64)

    @property
    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """Rays on the plane z = 1: x of the columns (1xW) and y of the rows (Hx1), float32."""
        x = (np.arange(self.width, dtype=np.float32) - self.cx) / self.fx
        y = (np.arange(self.height, dtype=np.float32) - self.cy) / self.fy
        return x.astype(np.float32)[None], y.astype(np.float32)[:, None]


@functools.lru_cache(maxsize=8)
def grid_of(camera: Camera, cell: int) -> Grid:
    """Return the camera whose pixels are cells with a side of so many pixels."""
    centre = (cell - 1) / 2  # of the first cell [px]
    return Grid(camera.width // cell, camera.height // cell, camera.fx / cell, camera.fy / cell,
                (camera.cx - centre) / cell, (camera.cy - centre) / cell)


@functools.lru_cache(maxsize=8)
def _undistortion(camera: Camera, cell: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the columns and rows of undistorted cells in the image; None without distortion."""
    if not camera.distortion:
        return None
    grid = grid_of(camera, cell)
    x, y = np.broadcast_arrays(*grid.rays)
    rays = np.column_stack([x.ravel(), y.ravel(), np.ones(x.size)])
    pixels = camera.project(rays)
    # outside of its range a distortion model folds rays back into the image
    error = np.abs(camera.normalize(pixels) - rays[:, :2]).max(axis=1)
    pixels[~(error < _MAX_ROUND_TRIP_ERROR)] = -1e4
    cells = (pixels - (cell - 1) / 2) / cell
    columns, rows = np.ascontiguousarray(cells.T, np.float32)
    return columns, rows


def inverse_depths(depth: np.ndarray, camera: Camera, sensor: SensorSettings,
                   cell: int) -> np.ndarray:
    """
    Return the mean inverse depth of the cells, HxW float32; NaN where a pixel is invalid [1/m].

    :param depth: of the image, float32 [m], NaN where invalid.
    """
    grid = grid_of(camera, cell)
    inverse = np.empty((grid.height, grid.width), np.float32)
    kernels.mean_inverse_depths(
        depth, cell, 1 / sensor.max_depth, 1 / max(sensor.min_depth, _MIN_DEPTH), inverse)
    places = _undistortion(camera, cell)
    if places is None or min(inverse.shape) < 2:
        return inverse
    undistorted = np.empty_like(inverse)
    kernels.interpolate(inverse, *places, undistorted.ravel())
    return undistorted
