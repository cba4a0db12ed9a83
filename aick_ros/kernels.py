# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The loops over pixels, keypoints and cells that are compiled (``src/kernels``)."""

try:
    from aick_ros._kernels import (
        cells_at, depth_rows, distortion_rows, edges_beside, gradient_moments, gradient_noise,
        inverse_depth_slopes, keypoint_rows, moved_by_rows, nodes_around, normal_equations,
        plane_jacobians, point_to_plane, project, reprojection, robust_weights, sample_depth,
        track_depth, window_shifts)
except ModuleNotFoundError as error:
    raise ImportError('aick_ros is not compiled: install it (pip install . or colcon build), '
                      'which takes a C compiler') from error

__all__ = ['cells_at', 'depth_rows', 'distortion_rows', 'edges_beside', 'gradient_moments',
           'gradient_noise', 'inverse_depth_slopes', 'keypoint_rows', 'moved_by_rows',
           'nodes_around', 'normal_equations', 'plane_jacobians', 'point_to_plane', 'project',
           'reprojection', 'robust_weights', 'sample_depth', 'track_depth', 'window_shifts']
