// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Moments of matched points, for a rigid fit.

#include <stdint.h>

#include "arrays.h"
#include "kernels.h"

// Add the products of matched points (x, y, z, 1), 4x4; return false where a row is not a point.
static bool add_products(const float *source, Py_ssize_t source_count, const float *target,
                         Py_ssize_t target_count, const int64_t *matches, Py_ssize_t count,
                         double *moments) {
  for (Py_ssize_t k = 0; k < count; ++k) {
    const int64_t i = matches[2 * k], j = matches[2 * k + 1];
    if (i < 0 || i >= source_count || j < 0 || j >= target_count)
      return false;
    const float *a = source + 3 * i, *b = target + 3 * j;
    const double left[4] = {a[0], a[1], a[2], 1.0}, right[4] = {b[0], b[1], b[2], 1.0};
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column)
        moments[4 * row + column] += left[row] * right[column];
  }
  return true;
}

PyObject *kernel_moments(PyObject *module, PyObject *arguments) {
  PyObject *source_array, *target_array, *match_array, *moment_array;
  if (!PyArg_ParseTuple(arguments, "OOOO", &source_array, &target_array, &match_array,
                        &moment_array))
    return NULL;
  const Py_ssize_t source_count = PyObject_Length(source_array);
  const Py_ssize_t target_count = PyObject_Length(target_array);
  const Py_ssize_t count = PyObject_Length(match_array);
  const Argument needed[] = {
      {"the source", source_array, 'f', 3 * source_count, false},
      {"the target", target_array, 'f', 3 * target_count, false},
      {"the matches", match_array, 'q', 2 * count, false},
      {"the moments", moment_array, 'd', 16, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const float *source = arrays.views[0].buf, *target = arrays.views[1].buf;
  const int64_t *matches = arrays.views[2].buf;
  double *moments = arrays.views[3].buf;
  bool are_rows;
  Py_BEGIN_ALLOW_THREADS
  are_rows = add_products(source, source_count, target, target_count, matches, count, moments);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_rows) {
    PyErr_SetString(PyExc_ValueError, "a row of a match is not one of the points");
    return NULL;
  }
  Py_RETURN_NONE;
}
