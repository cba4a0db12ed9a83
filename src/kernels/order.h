// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Values at a place in their order, without sorting all of them.

#ifndef AICK_ROS_ORDER_H
#define AICK_ROS_ORDER_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

// Return the value that would be at an index if the values were sorted; they are reordered.
double selected(double *values, Py_ssize_t count, Py_ssize_t index);

#endif
