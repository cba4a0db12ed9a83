# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Edges of a depth image where what is near hides what is behind it.

They show a motion along a wall, which planes do not: the arm of a sofa, a lamp, a door frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from aick_ros.frames.depth_cells import Grid, grid_of, inverse_depths
from aick_ros.frames.surface import FINE_CELL, shuffled
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

# All chosen on an excerpt of a real recording and on rendered rooms with three kinds of cameras.
_LEAST_STEP = 0.05  # of the inverse depth at an edge, as a ratio to the nearer one
_LEAST_STEP_SIGMAS = 8.0  # the same, in standard deviations of the depth noise, added to that
_WIDEST_GAP = 4  # cells without depth that a shadow has beside an edge
_FEWEST_TOGETHER = 3  # cells of an edge in a square of five by five: fewer are noise
_SMOOTHING = 2.0  # of the image whose gradient is across the edges [cells]
_MOST_POINTS = 300  # that are compared with another image
_ABOUT = np.ones(2 * (2 * _WIDEST_GAP + 1,), np.uint8)  # by definition: cells about one
_FAR = np.float32(1e3)  # inverse depth where there is none [1/m]; larger than any


@dataclass(frozen=True, eq=False)
class DepthEdges:
    """
    Points on the near side of the edges.

    :param grid: camera of the cells.
    :param cells: Nx2 int64, column and row of each.
    :param points: Nx3, in the optical frame [m].
    :param across: Nx2, direction across the edge in the image, to the near side, of length one.
    """

    grid: Grid
    cells: np.ndarray
    points: np.ndarray
    across: np.ndarray

    @classmethod
    def of(cls, depth: np.ndarray, camera: Camera, sensor: SensorSettings) -> DepthEdges:
        """
        Return the edges of a depth image.

        :param depth: HxW float32 [m], NaN where invalid.
        """
        grid = grid_of(camera, FINE_CELL)
        inverse = np.nan_to_num(inverse_depths(depth, camera, sensor, FINE_CELL))
        behind = _farthest(inverse)
        rows, columns = _near_side(inverse, behind, sensor).nonzero()
        depths = 1.0 / inverse[rows, columns].astype(np.float64)
        rays = np.column_stack([(columns - grid.cx) / grid.fx, (rows - grid.cy) / grid.fy,
                                np.ones(len(rows))])
        filled = np.where((inverse == 0.0) & (behind < _FAR), behind, inverse)
        return cls(grid, np.column_stack([columns, rows]).astype(np.int64), rays * depths[:, None],
                   _gradients(filled, rows, columns))

    @cached_property
    def chosen(self) -> np.ndarray:
        """Indices of the points that are compared with another image."""
        return np.sort(shuffled(len(self.cells))[:_MOST_POINTS])

    @cached_property
    def depths(self) -> np.ndarray:
        """Depths of the points, N [m]."""
        return np.ascontiguousarray(self.points[:, 2])

    @cached_property
    def nearest(self) -> np.ndarray:
        """Of each cell the index of the nearest point, HxW int64; there is one at least."""
        columns, rows = self.cells.T
        is_off = np.ones((self.grid.height, self.grid.width), np.uint8)
        is_off[rows, columns] = 0
        _, labels = cv2.distanceTransformWithLabels(
            is_off, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL)
        indices = np.empty(len(rows) + 1, np.int64)
        indices[labels[rows, columns]] = np.arange(len(rows))
        nearest: np.ndarray = indices[labels]
        return nearest


def _farthest(inverse: np.ndarray) -> np.ndarray:
    """Return the smallest inverse depth about each cell, HxW; _FAR where there is none."""
    return cv2.erode(np.where(inverse > 0.0, inverse, _FAR), _ABOUT)


def _near_side(inverse: np.ndarray, behind: np.ndarray, sensor: SensorSettings) -> np.ndarray:
    """
    Return which cells are the last ones of what is near, HxW bool.

    What is behind has to be farther by more than the slope of what is near explains.
    """
    is_known = inverse > 0.0
    noise = sensor.depth_sigma * np.where(is_known, inverse, 1.0) ** -sensor.inverse_depth_exponent
    step = _LEAST_STEP * inverse + _LEAST_STEP_SIGMAS * noise
    beside, before = cv2.erode(inverse, np.ones((3, 3), np.uint8)), cv2.dilate(inverse, _ABOUT)
    is_edge: np.ndarray = (is_known & (inverse - beside > step)
                           & (inverse - behind > step + (before - inverse)))
    together = cv2.boxFilter(is_edge.astype(np.float32), -1, (5, 5), normalize=False)
    is_edge &= together > _FEWEST_TOGETHER - 0.5
    for border in (is_edge[:2], is_edge[-2:], is_edge[:, :2], is_edge[:, -2:]):
        border[...] = False
    return is_edge


def _gradients(inverse: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return the directions of the gradient of an image at some cells, Nx2."""
    smooth = cv2.GaussianBlur(inverse, (0, 0), _SMOOTHING)
    gradients = np.column_stack([cv2.Sobel(smooth, cv2.CV_32F, *order)[rows, columns]
                                 for order in ((1, 0), (0, 1))]).astype(np.float64)
    lengths = np.linalg.norm(gradients, axis=1, keepdims=True)
    directions: np.ndarray = gradients / np.maximum(lengths, np.finfo(float).tiny)
    return directions
