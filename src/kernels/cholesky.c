// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Linear equations with a positive definite matrix, by its Cholesky factor.

#include "cholesky.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"
#include "products.h"

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

// Normal equations of some unknowns, and of others that come first.
typedef struct {
  const double *information, *prior, *gradients;  // the prior is that of the others
  Py_ssize_t size, others, rows;                  // of all unknowns, of the others, of gradients
} Joint;

// Eliminate the others; there is room for their prior information and a row for each.
static bool eliminate(const Joint *from, double *factor, double *gains, double *information,
                      double *gradients) {
  const Py_ssize_t others = from->others, left = from->size - others;
  for (Py_ssize_t i = 0; i < others; ++i) {
    const double *row = from->information + from->size * i;
    for (Py_ssize_t j = 0; j < others; ++j)
      factor[others * i + j] = row[j] + from->prior[others * i + j];
    memcpy(gains + left * i, row + others, (size_t)left * sizeof(*gains));
  }
  if (!factorize(factor, others))
    return false;
  substitute(factor, others, gains, left);
  for (Py_ssize_t i = 0; i < left; ++i) {
    const double *row = from->information + from->size * (others + i);
    memcpy(information + left * i, row + others, (size_t)left * sizeof(*information));
    add_product(row, gains, 1, others, left, -1.0, information + left * i);
  }
  for (Py_ssize_t i = 0; i < from->rows; ++i) {
    const double *row = from->gradients + from->size * i;
    memcpy(gradients + left * i, row + others, (size_t)left * sizeof(*gradients));
    add_product(row, gains, 1, others, left, -1.0, gradients + left * i);
  }
  return true;
}

PyObject *kernel_eliminate(PyObject *module, PyObject *arguments) {
  PyObject *information_array, *gradient_array, *prior_array, *left_array, *left_gradient_array;
  if (!PyArg_ParseTuple(arguments, "OOOOO", &information_array, &gradient_array, &prior_array,
                        &left_array, &left_gradient_array))
    return NULL;
  Joint joint = {.size = row_count(information_array), .others = row_count(prior_array),
                 .rows = row_count(gradient_array)};
  if (joint.size > MOST_UNKNOWNS || joint.others > joint.size || joint.rows > MOST_SIDES) {
    PyErr_SetString(PyExc_ValueError, "the unknowns are too many");
    return NULL;
  }
  const Py_ssize_t size = joint.size, others = joint.others, left = size - others;
  const Argument needed[] = {
      {"the information", information_array, 'd', size * size, false},
      {"the gradients", gradient_array, 'd', joint.rows * size, false},
      {"the prior", prior_array, 'd', others * others, false},
      {"the information left", left_array, 'd', left * left, true},
      {"the gradients left", left_gradient_array, 'd', joint.rows * left, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  joint.information = arrays.views[0].buf;
  joint.gradients = arrays.views[1].buf;
  joint.prior = arrays.views[2].buf;
  double *room = malloc((size_t)(others * size + 1) * sizeof(*room));
  const bool has_room = room != NULL;
  const bool is_definite = has_room && eliminate(&joint, room, room + others * others,
                                                 arrays.views[3].buf, arrays.views[4].buf);
  free(room);
  close_arrays(&arrays);
  return has_room ? PyBool_FromLong(is_definite) : PyErr_NoMemory();
}
