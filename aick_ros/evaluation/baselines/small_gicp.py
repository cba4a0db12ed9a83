# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
small_gicp (Koide 2024): generalized ICP on downsampled point clouds.

Measured on handheld Kinect sequences: removing lens distortion, 20 instead of 10 neighbours for
the covariances, and finer convergence thresholds than the defaults (0.1 deg, 1 mm) improve the
accuracy at little cost.
"""

from __future__ import annotations

from typing import Any

import small_gicp

from aick_ros.evaluation.baselines import Estimate
from aick_ros.evaluation.baselines.dense import point_cloud
from aick_ros.frames.rgbd import RgbdFrame

_MIN_POINTS = 100  # fewer have no useful neighbourhoods; chosen


class SmallGicp:
    """
    GICP from the identity, one thread.

    :param voxel: side of the voxels for downsampling [m].
    :param neighbours: number of neighbours for the covariance of a point.
    :param max_distance: largest distance of corresponding points [m].
    :param max_depth: farther points are ignored [m].
    :param iterations: maximum number of iterations.
    :param epsilon: step at which the iteration has converged [rad, m].
    """

    def __init__(self, voxel: float, neighbours: int, max_distance: float, max_depth: float,
                 iterations: int, epsilon: float) -> None:
        self._voxel, self._neighbours, self._max_depth = voxel, neighbours, max_depth
        self._options = {
            'registration_type': 'GICP', 'max_correspondence_distance': max_distance,
            'max_iterations': iterations, 'rotation_epsilon': epsilon,
            'translation_epsilon': epsilon, 'num_threads': 1}

    def prepare(self, frame: RgbdFrame) -> tuple[Any, Any]:
        """Return the downsampled points with their covariances, and their k-d tree."""
        points = point_cloud(frame, self._max_depth)
        cloud, tree = small_gicp.preprocess_points(points, self._voxel, self._neighbours, 1)
        return cloud, tree

    def register(self, source: tuple[Any, Any], target: tuple[Any, Any]) -> Estimate:
        """Return the transform."""
        (source_points, _), (target_points, target_tree) = source, target
        if min(source_points.size(), target_points.size()) < _MIN_POINTS:
            return Estimate(None, 'too few points')
        result = small_gicp.align(target_points, source_points, target_tree, **self._options)
        return Estimate(result.T_target_source)
