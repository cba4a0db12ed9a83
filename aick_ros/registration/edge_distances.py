# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Distances of the edges of one depth image from those of another.

A point is compared with the edge that is nearest to where it projects, across that edge alone: it
may move along it.
"""

from __future__ import annotations

import numpy as np

from aick_ros.frames.depth_edges import DepthEdges
from aick_ros.geometry import se3
from aick_ros.registration.refinement.residuals import Residuals

# All chosen on an excerpt of a real recording and on rendered rooms with three kinds of cameras.
_REACH = 6.0  # cells; larger distances are of other edges
_LARGEST_DEPTH_ERROR = 0.15  # of the depth of the edge; others are of something else
_SMALLEST_COSINE = 0.7  # between the directions across both edges, in the image
_FEWEST = 10  # points; fewer say nothing
_SMALLEST_SIGMA = 0.7  # cells; what rounding to a cell and noise leave at least
_WIDTH = 3.0  # of the robust weights, in standard deviations
_PER_MEDIAN = 1.4826  # derived: standard deviation of normal noise by its median absolute value
_BLOCK, _BLOCKS_ACROSS, _FARTHEST = 0.2, 21, 2.0  # on the plane z = 1, as those of other residuals


def edge_distances(source: DepthEdges, target: DepthEdges,
                   T_target_source: np.ndarray) -> Residuals:
    """
    Return the distances across the edges of the target, in units of their standard deviation.

    That is measured on the distances themselves.

    :param T_target_source: pose of the depth images, 4x4.
    """
    places, at = _associated(source, target, T_target_source)
    if len(places) < _FEWEST:
        return Residuals(np.empty(0), np.empty((0, 6)), np.empty(0), np.empty(0, np.int64))
    points = se3.transform(T_target_source, source.points[places])
    rays, across = points[:, :2] / points[:, 2:], target.across[at]
    distances = ((_pixels(target, rays) - target.cells[at]) * across).sum(axis=1)
    sigma = max(_PER_MEDIAN * float(np.median(np.abs(distances))), _SMALLEST_SIGMA)
    slopes = across * (target.grid.fx, target.grid.fy) / points[:, 2:]
    slopes = np.column_stack([slopes, -(slopes * rays).sum(axis=1)])
    jacobian = np.hstack([slopes, np.cross(points - T_target_source[:3, 3], slopes)])
    weights = (1.0 + (distances / (_WIDTH * sigma)) ** 2) ** -2.0
    return Residuals(distances / sigma, jacobian / sigma, weights, _blocks(rays))


def _associated(source: DepthEdges, target: DepthEdges,
                T_target_source: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of points of the source and of those of the target beside them."""
    chosen, nothing = source.chosen, np.empty(0, np.intp)
    points = se3.transform(T_target_source, source.points[chosen])
    in_front = points[:, 2] > 0.0
    chosen, points = chosen[in_front], points[in_front]
    pixels = _pixels(target, points[:, :2] / points[:, 2:])
    columns, rows = np.rint(np.clip(pixels, -1.0, 1e6)).astype(np.intp).T
    is_inside = ((columns >= 0) & (columns < target.grid.width)
                 & (rows >= 0) & (rows < target.grid.height))
    if not len(target.cells) or not is_inside.any():
        return nothing, nothing
    chosen, points, pixels = chosen[is_inside], points[is_inside], pixels[is_inside]
    at = target.nearest[rows[is_inside], columns[is_inside]]
    depths = target.points[at, 2]
    is_same = ((np.abs(points[:, 2] - depths) < _LARGEST_DEPTH_ERROR * depths)
               & (np.hypot(*(pixels - target.cells[at]).T) < _REACH)
               & ((source.across[chosen] * target.across[at]).sum(axis=1) > _SMALLEST_COSINE))
    return chosen[is_same], at[is_same]


def _pixels(edges: DepthEdges, rays: np.ndarray) -> np.ndarray:
    grid = edges.grid
    pixels: np.ndarray = rays * (grid.fx, grid.fy) + (grid.cx, grid.cy)
    return pixels


def _blocks(rays: np.ndarray) -> np.ndarray:
    """Return the number of the block of the image that each ray is in."""
    along = ((np.clip(rays, -_FARTHEST, _FARTHEST) + _FARTHEST) / _BLOCK).astype(np.int64)
    blocks: np.ndarray = _BLOCKS_ACROSS * along[:, 0] + along[:, 1]
    return blocks
