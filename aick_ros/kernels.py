# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The loops over pixels, keypoints and cells that are compiled (``src/kernels``)."""

try:
    from aick_ros._kernels import (
        cells_at, gradient_noise, moved_by_rows, normal_equations, point_to_plane, project,
        reprojection, sample_depth, track_depth)
except ModuleNotFoundError as error:
    raise ImportError('aick_ros is not compiled: install it (pip install . or colcon build), '
                      'which takes a C compiler') from error

__all__ = ['cells_at', 'gradient_noise', 'moved_by_rows', 'normal_equations', 'point_to_plane',
           'project', 'reprojection', 'sample_depth', 'track_depth']
