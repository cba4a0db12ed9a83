// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Lists of pairs of keypoints that grow while a kernel finds them.

#ifndef AICK_ROS_PAIRS_H
#define AICK_ROS_PAIRS_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct {
  int64_t *sources, *targets;
  Py_ssize_t count, room;
} Pairs;

// Add the pairs of a source whose values, one per target, are below a bound; return false where
// there is no memory.
bool add_below(Pairs *pairs, Py_ssize_t source, const float *values, Py_ssize_t count,
               float bound);

// Add the pairs of a source with some targets; return false where there is no memory.
bool add_targets(Pairs *pairs, Py_ssize_t source, const int64_t *targets, Py_ssize_t count);

// Free the list, and return its rows as bytes, 2xK int64; set a MemoryError where it is not
// complete.
PyObject *take_pairs(Pairs *pairs, bool is_complete);

#endif
