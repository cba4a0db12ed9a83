# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Compiled functions (``src/kernels``): loops over pixels, keypoints and cells; small algebra."""

from aick_ros.errors import InputError

try:
    from aick_ros._kernels import (
        DIGEST, agreeing_tracks, align_windows, bias_since, biased_increment, bit_distances,
        bit_distances_of_pairs, cells_at, choose_cells, closest_pairs, composed_poses, corners,
        corrected_tracks, depth_equations, derivative_squares, describe_points, disc_directions,
        edge_distances, eliminate, estimate, exp_pose, exp_rotation, filled_depth, fit_moments,
        fit_planes, gradient_moments, gradient_noise, halve, integrate_forces, integrate_turns,
        interpolate, inverse_pose, inverted_warps, is_rigid, is_valid_depth, jackknife,
        joint_estimate, kalman_measurement, kalman_update, keypoint_equations, log_pose,
        log_rotation, mean_displacement, mean_inverse_depths, moments, nearer_beside, nodes_around,
        normal_buckets, normal_equations, normalize, pairs_of_near_points, pairs_of_similar_bits,
        perturbed_pose, point_to_plane, pose_difference, predict_gravity, project,
        propagated_covariance, relative_pose, reprojection, reversed_tracks, sample_depth, shrink,
        smooth_cells, solve_definite, spread, stamp_errors, to_quaternion, track_depth,
        track_steps, transform, undistort_depth, valid_depth, visible, window_reliefs,
        window_shifts, window_warps)
except ModuleNotFoundError as error:
    raise InputError('aick_ros is not compiled: install it (pip install . or colcon build), '
                     'which takes a C compiler') from error

__all__ = ['DIGEST', 'agreeing_tracks', 'align_windows', 'bias_since', 'biased_increment',
           'bit_distances', 'bit_distances_of_pairs', 'cells_at', 'choose_cells', 'closest_pairs',
           'composed_poses', 'corners', 'corrected_tracks', 'depth_equations',
           'derivative_squares', 'describe_points', 'disc_directions', 'edge_distances',
           'eliminate', 'estimate', 'exp_pose', 'exp_rotation', 'filled_depth', 'fit_moments',
           'fit_planes', 'gradient_moments', 'gradient_noise', 'halve', 'integrate_forces',
           'integrate_turns', 'interpolate', 'inverse_pose', 'inverted_warps', 'is_rigid',
           'is_valid_depth', 'jackknife', 'joint_estimate', 'kalman_measurement', 'kalman_update',
           'keypoint_equations', 'log_pose', 'log_rotation', 'mean_displacement',
           'mean_inverse_depths', 'moments', 'nearer_beside', 'nodes_around', 'normal_buckets',
           'normal_equations', 'normalize', 'pairs_of_near_points', 'pairs_of_similar_bits',
           'perturbed_pose', 'point_to_plane', 'pose_difference', 'predict_gravity', 'project',
           'propagated_covariance', 'relative_pose', 'reprojection', 'reversed_tracks',
           'sample_depth', 'shrink', 'smooth_cells', 'solve_definite', 'spread', 'stamp_errors',
           'to_quaternion', 'track_depth', 'track_steps', 'transform', 'undistort_depth',
           'valid_depth', 'visible', 'window_reliefs', 'window_shifts', 'window_warps']
