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

enum { MOST_SIDES = 1 << 20 };

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

void substitute_down(const double *factor, Py_ssize_t size, double *sides, Py_ssize_t count) {
  for (Py_ssize_t i = 0; i < size; ++i) {
    for (Py_ssize_t k = 0; k < i; ++k)
      for (Py_ssize_t n = 0; n < count; ++n)
        sides[count * i + n] -= factor[size * i + k] * sides[count * k + n];
    for (Py_ssize_t n = 0; n < count; ++n)
      sides[count * i + n] *= factor[size * i + i];
  }
}

void substitute(const double *factor, Py_ssize_t size, double *sides, Py_ssize_t count) {
  substitute_down(factor, size, sides, count);
  for (Py_ssize_t i = size - 1; i >= 0; --i) {
    for (Py_ssize_t k = i + 1; k < size; ++k)
      for (Py_ssize_t n = 0; n < count; ++n)
        sides[count * i + n] -= factor[size * k + i] * sides[count * k + n];
    for (Py_ssize_t n = 0; n < count; ++n)
      sides[count * i + n] *= factor[size * i + i];
  }
}

bool invert(const double *matrix, Py_ssize_t size, double *inverse) {
  double factor[MOST_UNKNOWNS * MOST_UNKNOWNS];
  memcpy(factor, matrix, (size_t)(size * size) * sizeof(*factor));
  if (!factorize(factor, size))
    return false;
  for (Py_ssize_t i = 0; i < size; ++i)
    for (Py_ssize_t j = 0; j < size; ++j)
      inverse[size * i + j] = i == j;
  substitute(factor, size, inverse, size);
  return true;
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

// Normal equations of groups, of which some unknowns are sought.
typedef struct {
  const double *information, *gradients, *prior, *known;
  const int64_t *sought;
  Py_ssize_t groups, size, count;  // of groups, of all unknowns, of those sought
} Groups;

// Solve the equations of all groups but one, or of all; there is room for a matrix.
static bool solve_without(const Groups *from, Py_ssize_t without, double *factor,
                          double *solution) {
  const Py_ssize_t size = from->size, count = from->count;
  for (Py_ssize_t i = 0; i < count; ++i) {
    const int64_t row = from->sought[i];
    for (Py_ssize_t j = 0; j <= i; ++j)
      factor[count * i + j] = from->prior[size * row + from->sought[j]];
    solution[i] = 0.0;
  }
  for (Py_ssize_t group = 0; group < from->groups; ++group) {
    if (group == without)
      continue;
    for (Py_ssize_t i = 0; i < count; ++i) {
      const int64_t row = size * group + from->sought[i];
      const double *information = from->information + size * row;
      for (Py_ssize_t j = 0; j <= i; ++j)
        factor[count * i + j] += information[from->sought[j]];
      solution[i] += from->gradients[row];
      for (Py_ssize_t j = 0; j < size; ++j)
        solution[i] -= information[j] * from->known[j];
    }
  }
  if (!factorize(factor, count))
    return false;
  substitute(factor, count, solution, 1);
  return true;
}

// Solve the equations of all groups, and those without each one; there is room for a matrix and
// a row.
static bool solve_groups(const Groups *from, double *room, double *estimate, double *scatter) {
  double *solution = room + from->count * from->count;
  for (Py_ssize_t group = -1; group < from->groups; ++group) {
    if (!solve_without(from, group, room, solution))
      return false;
    double *found = group < 0 ? estimate : scatter + from->size * group;
    for (Py_ssize_t i = 0; i < from->count; ++i) {
      const int64_t unknown = from->sought[i];
      found[unknown] = group < 0 ? solution[i] : solution[i] - estimate[unknown];
    }
  }
  return true;
}

PyObject *kernel_jackknife(PyObject *module, PyObject *arguments) {
  PyObject *objects[7];
  if (!PyArg_ParseTuple(arguments, "OOOOOOO", &objects[0], &objects[1], &objects[2], &objects[3],
                        &objects[4], &objects[5], &objects[6]))
    return NULL;
  Groups from = {.groups = row_count(objects[1]), .size = row_count(objects[2]),
                 .count = row_count(objects[4])};
  if (from.size > MOST_UNKNOWNS || from.count > from.size || from.groups > MOST_SIDES) {
    PyErr_SetString(PyExc_ValueError, "the unknowns are too many");
    return NULL;
  }
  const Py_ssize_t groups = from.groups, size = from.size;
  const Argument needed[] = {
      {"the information", objects[0], 'd', groups * size * size, false},
      {"the gradients", objects[1], 'd', groups * size, false},
      {"the prior", objects[2], 'd', size * size, false},
      {"the known values", objects[3], 'd', size, false},
      {"the unknowns", objects[4], 'q', from.count, false},
      {"the estimate", objects[5], 'd', size, true},
      {"the scatter", objects[6], 'd', groups * size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  from.information = views[0].buf;
  from.gradients = views[1].buf;
  from.prior = views[2].buf;
  from.known = views[3].buf;
  from.sought = views[4].buf;
  bool are_known = true, is_definite = false;
  for (Py_ssize_t i = 0; i < from.count; ++i)
    are_known &= 0 <= from.sought[i] && from.sought[i] < size;
  double *room = malloc((size_t)(from.count * (from.count + 1) + 1) * sizeof(*room));
  if (are_known && room != NULL)
    is_definite = solve_groups(&from, room, views[5].buf, views[6].buf);
  else if (are_known)
    PyErr_NoMemory();
  else
    PyErr_SetString(PyExc_ValueError, "an unknown is none of the equations");
  const bool has_failed = !are_known || room == NULL;
  free(room);
  close_arrays(&arrays);
  return has_failed ? NULL : PyBool_FromLong(is_definite);
}
