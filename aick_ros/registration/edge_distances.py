# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Distances of the edges of one depth image from those of another.

A point is compared with the edge that is nearest to where it projects, across that edge alone: it
may move along it.
"""

from __future__ import annotations

import numpy as np

from aick_ros import kernels
from aick_ros.frames.depth_edges import DepthEdges
from aick_ros.geometry.median import SIGMA_PER_MEDIAN, median
from aick_ros.registration.refinement.residuals import Residuals

# All chosen on an excerpt of a real recording and on rendered rooms with three kinds of cameras.
_REACH = 6.0  # cells; larger distances are of other edges
_LARGEST_DEPTH_ERROR = 0.15  # of the depth of the edge; others are of something else
_SMALLEST_COSINE = 0.7  # between the directions across both edges, in the image
_FEWEST = 10  # points; fewer say nothing
_SMALLEST_SIGMA = 0.7  # cells; what rounding to a cell and noise leave at least
_WIDTH = 3.0  # of the robust weights, in standard deviations

_NONE = Residuals(np.empty(0), np.empty((0, 6)), np.empty(0), np.empty(0, np.int64))


def edge_distances(source: DepthEdges, target: DepthEdges,
                   T_target_source: np.ndarray) -> Residuals:
    """
    Return the distances across the edges of the target, in units of their standard deviation.

    That is measured on the distances themselves.

    :param T_target_source: pose of the depth images, 4x4.
    """
    chosen, count = source.chosen, len(source.chosen)
    if not len(target.cells):
        return _NONE
    distances, jacobian = np.empty(count), np.empty((count, 6))
    blocks = np.empty(count, np.int64)
    found = kernels.edge_distances(
        source.points[chosen], source.across[chosen], T_target_source, target.grid.intrinsics,
        target.nearest, target.cells, target.depths, target.across, _REACH, _LARGEST_DEPTH_ERROR,
        _SMALLEST_COSINE, distances, jacobian, blocks)
    if found < _FEWEST:
        return _NONE
    distances = distances[:found]
    sigma = max(SIGMA_PER_MEDIAN * median(np.abs(distances)), _SMALLEST_SIGMA)
    weights = (1.0 + (distances / (_WIDTH * sigma)) ** 2) ** -2.0
    return Residuals(distances / sigma, jacobian[:found] / sigma, weights, blocks[:found])
