// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "kernels.h"

#define KERNEL(name) {#name, kernel_##name, METH_VARARGS, NULL}

static PyMethodDef METHODS[] = {
    KERNEL(agreeing_tracks),
    KERNEL(align_windows),
    KERNEL(bias_since),
    KERNEL(biased_increment),
    KERNEL(bit_distances),
    KERNEL(bit_distances_of_pairs),
    KERNEL(cells_at),
    KERNEL(choose_cells),
    KERNEL(closest_pairs),
    KERNEL(composed_poses),
    KERNEL(corners),
    KERNEL(corrected_tracks),
    KERNEL(depth_equations),
    KERNEL(derivative_squares),
    KERNEL(describe_points),
    KERNEL(disc_directions),
    KERNEL(edge_distances),
    KERNEL(eliminate),
    KERNEL(estimate),
    KERNEL(exp_pose),
    KERNEL(exp_rotation),
    KERNEL(filled_depth),
    KERNEL(fit_moments),
    KERNEL(fit_planes),
    KERNEL(gradient_moments),
    KERNEL(gradient_noise),
    KERNEL(halve),
    KERNEL(integrate_forces),
    KERNEL(integrate_turns),
    KERNEL(interpolate),
    KERNEL(inverse_pose),
    KERNEL(inverted_warps),
    KERNEL(is_rigid),
    KERNEL(is_valid_depth),
    KERNEL(jackknife),
    KERNEL(joint_estimate),
    KERNEL(kalman_measurement),
    KERNEL(kalman_update),
    KERNEL(keypoint_equations),
    KERNEL(log_pose),
    KERNEL(log_rotation),
    KERNEL(mean_displacement),
    KERNEL(mean_inverse_depths),
    KERNEL(moments),
    KERNEL(nearer_beside),
    KERNEL(nodes_around),
    KERNEL(normal_buckets),
    KERNEL(normal_equations),
    KERNEL(normalize),
    KERNEL(pairs_of_near_points),
    KERNEL(pairs_of_similar_bits),
    KERNEL(perturbed_pose),
    KERNEL(point_to_plane),
    KERNEL(pose_difference),
    KERNEL(predict_gravity),
    KERNEL(project),
    KERNEL(propagated_covariance),
    KERNEL(relative_pose),
    KERNEL(reprojection),
    KERNEL(reversed_tracks),
    KERNEL(sample_depth),
    KERNEL(shrink),
    KERNEL(smooth_cells),
    KERNEL(solve_definite),
    KERNEL(spread),
    KERNEL(stamp_errors),
    KERNEL(to_quaternion),
    KERNEL(track_depth),
    KERNEL(track_steps),
    KERNEL(transform),
    KERNEL(undistort_depth),
    KERNEL(valid_depth),
    KERNEL(visible),
    KERNEL(window_reliefs),
    KERNEL(window_shifts),
    KERNEL(window_warps),
    {NULL, NULL, 0, NULL},
};

// What the kernels were made of, as setup.py has it.
static int add_digest(PyObject *module) {
  return PyModule_AddStringConstant(module, "DIGEST", DIGEST);
}

static PyModuleDef_Slot SLOTS[] = {{Py_mod_exec, add_digest}, {0, NULL}};

static struct PyModuleDef MODULE = {PyModuleDef_HEAD_INIT, .m_name = "aick_ros._kernels",
                                    .m_methods = METHODS, .m_slots = SLOTS};

PyMODINIT_FUNC PyInit__kernels(void) { return PyModuleDef_Init(&MODULE); }
