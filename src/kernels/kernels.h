// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// The kernels as functions of the module aick_ros._kernels; their parameters are those of the
// functions with the same names in aick_ros/_kernels.pyi.

#ifndef AICK_ROS_KERNELS_H
#define AICK_ROS_KERNELS_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

PyObject *kernel_agreeing_tracks(PyObject *module, PyObject *arguments);
PyObject *kernel_align_windows(PyObject *module, PyObject *arguments);
PyObject *kernel_bias_since(PyObject *module, PyObject *arguments);
PyObject *kernel_biased_increment(PyObject *module, PyObject *arguments);
PyObject *kernel_bit_distances(PyObject *module, PyObject *arguments);
PyObject *kernel_bit_distances_of_pairs(PyObject *module, PyObject *arguments);
PyObject *kernel_cells_at(PyObject *module, PyObject *arguments);
PyObject *kernel_choose_cells(PyObject *module, PyObject *arguments);
PyObject *kernel_closest_pairs(PyObject *module, PyObject *arguments);
PyObject *kernel_composed_poses(PyObject *module, PyObject *arguments);
PyObject *kernel_corners(PyObject *module, PyObject *arguments);
PyObject *kernel_corrected_tracks(PyObject *module, PyObject *arguments);
PyObject *kernel_depth_equations(PyObject *module, PyObject *arguments);
PyObject *kernel_derivative_squares(PyObject *module, PyObject *arguments);
PyObject *kernel_describe_points(PyObject *module, PyObject *arguments);
PyObject *kernel_disc_directions(PyObject *module, PyObject *arguments);
PyObject *kernel_edge_distances(PyObject *module, PyObject *arguments);
PyObject *kernel_eliminate(PyObject *module, PyObject *arguments);
PyObject *kernel_estimate(PyObject *module, PyObject *arguments);
PyObject *kernel_exp_pose(PyObject *module, PyObject *arguments);
PyObject *kernel_exp_rotation(PyObject *module, PyObject *arguments);
PyObject *kernel_filled_depth(PyObject *module, PyObject *arguments);
PyObject *kernel_fit_moments(PyObject *module, PyObject *arguments);
PyObject *kernel_fit_planes(PyObject *module, PyObject *arguments);
PyObject *kernel_gradient_moments(PyObject *module, PyObject *arguments);
PyObject *kernel_gradient_noise(PyObject *module, PyObject *arguments);
PyObject *kernel_halve(PyObject *module, PyObject *arguments);
PyObject *kernel_integrate_forces(PyObject *module, PyObject *arguments);
PyObject *kernel_integrate_turns(PyObject *module, PyObject *arguments);
PyObject *kernel_interpolate(PyObject *module, PyObject *arguments);
PyObject *kernel_inverse_pose(PyObject *module, PyObject *arguments);
PyObject *kernel_inverted_warps(PyObject *module, PyObject *arguments);
PyObject *kernel_is_rigid(PyObject *module, PyObject *arguments);
PyObject *kernel_is_valid_depth(PyObject *module, PyObject *arguments);
PyObject *kernel_jackknife(PyObject *module, PyObject *arguments);
PyObject *kernel_joint_estimate(PyObject *module, PyObject *arguments);
PyObject *kernel_kalman_measurement(PyObject *module, PyObject *arguments);
PyObject *kernel_kalman_update(PyObject *module, PyObject *arguments);
PyObject *kernel_keypoint_equations(PyObject *module, PyObject *arguments);
PyObject *kernel_log_pose(PyObject *module, PyObject *arguments);
PyObject *kernel_log_rotation(PyObject *module, PyObject *arguments);
PyObject *kernel_mean_displacement(PyObject *module, PyObject *arguments);
PyObject *kernel_mean_inverse_depths(PyObject *module, PyObject *arguments);
PyObject *kernel_moments(PyObject *module, PyObject *arguments);
PyObject *kernel_nearer_beside(PyObject *module, PyObject *arguments);
PyObject *kernel_nodes_around(PyObject *module, PyObject *arguments);
PyObject *kernel_normal_buckets(PyObject *module, PyObject *arguments);
PyObject *kernel_normal_equations(PyObject *module, PyObject *arguments);
PyObject *kernel_normalize(PyObject *module, PyObject *arguments);
PyObject *kernel_pairs_of_near_points(PyObject *module, PyObject *arguments);
PyObject *kernel_pairs_of_similar_bits(PyObject *module, PyObject *arguments);
PyObject *kernel_perturbed_pose(PyObject *module, PyObject *arguments);
PyObject *kernel_point_to_plane(PyObject *module, PyObject *arguments);
PyObject *kernel_pose_difference(PyObject *module, PyObject *arguments);
PyObject *kernel_predict_gravity(PyObject *module, PyObject *arguments);
PyObject *kernel_project(PyObject *module, PyObject *arguments);
PyObject *kernel_propagated_covariance(PyObject *module, PyObject *arguments);
PyObject *kernel_relative_pose(PyObject *module, PyObject *arguments);
PyObject *kernel_reprojection(PyObject *module, PyObject *arguments);
PyObject *kernel_reversed_tracks(PyObject *module, PyObject *arguments);
PyObject *kernel_sample_depth(PyObject *module, PyObject *arguments);
PyObject *kernel_shrink(PyObject *module, PyObject *arguments);
PyObject *kernel_smooth_cells(PyObject *module, PyObject *arguments);
PyObject *kernel_solve_definite(PyObject *module, PyObject *arguments);
PyObject *kernel_spread(PyObject *module, PyObject *arguments);
PyObject *kernel_stamp_errors(PyObject *module, PyObject *arguments);
PyObject *kernel_to_quaternion(PyObject *module, PyObject *arguments);
PyObject *kernel_track_depth(PyObject *module, PyObject *arguments);
PyObject *kernel_track_steps(PyObject *module, PyObject *arguments);
PyObject *kernel_transform(PyObject *module, PyObject *arguments);
PyObject *kernel_undistort_depth(PyObject *module, PyObject *arguments);
PyObject *kernel_valid_depth(PyObject *module, PyObject *arguments);
PyObject *kernel_visible(PyObject *module, PyObject *arguments);
PyObject *kernel_window_reliefs(PyObject *module, PyObject *arguments);
PyObject *kernel_window_shifts(PyObject *module, PyObject *arguments);
PyObject *kernel_window_warps(PyObject *module, PyObject *arguments);

#endif
