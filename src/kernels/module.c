// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "kernels.h"

#define KERNEL(name) {#name, kernel_##name, METH_VARARGS, NULL}

static PyMethodDef METHODS[] = {
    KERNEL(project),
    KERNEL(sample_depth),
    KERNEL(moved_by_rows),
    KERNEL(reprojection),
    KERNEL(track_depth),
    KERNEL(cells_at),
    KERNEL(point_to_plane),
    KERNEL(normal_equations),
    KERNEL(gradient_noise),
    KERNEL(edges_beside),
    KERNEL(gradient_moments),
    KERNEL(inverse_depth_slopes),
    KERNEL(plane_jacobians),
    KERNEL(window_shifts),
    KERNEL(robust_weights),
    KERNEL(keypoint_rows),
    KERNEL(depth_rows),
    KERNEL(nodes_around),
    KERNEL(distortion_rows),
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef MODULE = {
    PyModuleDef_HEAD_INIT, .m_name = "aick_ros._kernels", .m_methods = METHODS};

PyMODINIT_FUNC PyInit__kernels(void) { return PyModuleDef_Init(&MODULE); }
