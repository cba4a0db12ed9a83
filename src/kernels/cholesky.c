// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Linear equations with a positive definite matrix, by its Cholesky factor.

#include "cholesky.h"

#include <math.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"

enum { MOST_UNKNOWNS = 64, MOST_SIDES = 1 << 20 };

bool factorize(double *matrix, Py_ssize_t size) {
  for (Py_ssize_t i = 0; i < size; ++i) {
    double *row = matrix + size * i;
    for (Py_ssize_t j = 0; j <= i; ++j) {
      const double *other = matrix + size * j;
      double left = row[j];
      for (Py_ssize_t k = 0; k < j; ++k)
        left -= row[k] * other[k];
      if (j < i)
        row[j] = left * other[j];
      else if (left > 0.0 && left < INFINITY)
        row[i] = 1.0 / sqrt(left);
      else
        return false;
    }
  }
  return true;
}

void substitute(const double *factor, Py_ssize_t size, double *sides, Py_ssize_t count) {
  for (Py_ssize_t i = 0; i < size; ++i) {
    for (Py_ssize_t k = 0; k < i; ++k)
      for (Py_ssize_t n = 0; n < count; ++n)
        sides[count * i + n] -= factor[size * i + k] * sides[count * k + n];
    for (Py_ssize_t n = 0; n < count; ++n)
      sides[count * i + n] *= factor[size * i + i];
  }
  for (Py_ssize_t i = size - 1; i >= 0; --i) {
    for (Py_ssize_t k = i + 1; k < size; ++k)
      for (Py_ssize_t n = 0; n < count; ++n)
        sides[count * i + n] -= factor[size * k + i] * sides[count * k + n];
    for (Py_ssize_t n = 0; n < count; ++n)
      sides[count * i + n] *= factor[size * i + i];
  }
}

PyObject *kernel_solve_definite(PyObject *module, PyObject *arguments) {
  PyObject *matrix_array, *side_array;
  Py_ssize_t count;
  if (!PyArg_ParseTuple(arguments, "OOn", &matrix_array, &side_array, &count))
    return NULL;
  const Py_ssize_t size = row_count(matrix_array);
  if (size > MOST_UNKNOWNS || count < 0 || count > MOST_SIDES) {
    PyErr_SetString(PyExc_ValueError, "the equations are too many");
    return NULL;
  }
  const Argument needed[] = {
      {"the matrix", matrix_array, 'd', size * size, false},
      {"the right sides", side_array, 'd', size * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  double factor[MOST_UNKNOWNS * MOST_UNKNOWNS];
  memcpy(factor, arrays.views[0].buf, (size_t)(size * size) * sizeof(*factor));
  const bool is_definite = factorize(factor, size);
  if (is_definite)
    substitute(factor, size, arrays.views[1].buf, count);
  close_arrays(&arrays);
  return PyBool_FromLong(is_definite);
}
