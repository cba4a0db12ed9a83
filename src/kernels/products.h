// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Products of matrices, row by row.

#ifndef AICK_ROS_PRODUCTS_H
#define AICK_ROS_PRODUCTS_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

// Add the product of a matrix, height x depth, and another one of some width, times a factor.
static inline void add_product(const double *one, const double *other, Py_ssize_t height,
                               Py_ssize_t depth, Py_ssize_t width, double factor, double *sum) {
  for (Py_ssize_t i = 0; i < height; ++i)
    for (Py_ssize_t k = 0; k < depth; ++k)
      for (Py_ssize_t j = 0; j < width; ++j)
        sum[width * i + j] += factor * one[depth * i + k] * other[width * k + j];
}

#endif
