// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Sums over residuals, six unknowns each.

#include "equations.h"

#include <stdint.h>
#include <stdlib.h>

#include "arrays.h"
#include "kernels.h"
#include "processors.h"

enum { MOST_BLOCKS = 1 << 20 };

// Add the outer product of a vector, times a factor, to the upper triangle of a matrix.
static void add_outer(const double *vector, double factor, double *matrix) {
  for (int row = 0; row < UNKNOWNS; ++row) {
    const double scaled = factor * vector[row];
    for (int column = row; column < UNKNOWNS; ++column)
      matrix[UNKNOWNS * row + column] += scaled * vector[column];
  }
}

// Copy the upper triangle of a matrix to the lower one.
static void mirror(double *matrix) {
  for (int row = 1; row < UNKNOWNS; ++row)
    for (int column = 0; column < row; ++column)
      matrix[UNKNOWNS * row + column] = matrix[UNKNOWNS * column + row];
}

FOR_EACH_PROCESSOR
static void add_rows(const double *jacobian, const double *values, const double *weights,
                     Py_ssize_t count, double *information, double *gradient) {
  Products products = {0};
  for (Py_ssize_t i = 0; i < count; ++i)
    add_row(jacobian + UNKNOWNS * i, values[i], weights[i], &products);
  add_squares(&products, 1.0, information);
  for (int k = 0; k < UNKNOWNS; ++k)
    gradient[k] += products.right[k][2];
}

void add_equations(const double *jacobian, const double *values, const double *weights,
                   Py_ssize_t count, double *information, double *gradient) {
  add_rows(jacobian, values, weights, count, information, gradient);
}

PyObject *kernel_normal_equations(PyObject *module, PyObject *arguments) {
  PyObject *jacobian_array, *value_array, *weight_array, *information_array, *gradient_array;
  if (!PyArg_ParseTuple(arguments, "OOOOO", &jacobian_array, &value_array, &weight_array,
                        &information_array, &gradient_array))
    return NULL;
  const Py_ssize_t count = row_count(value_array);
  const Argument needed[] = {
      {"the jacobian", jacobian_array, 'd', UNKNOWNS * count, false},
      {"the values", value_array, 'd', count, false},
      {"the weights", weight_array, 'd', count, false},
      {"the information", information_array, 'd', UNKNOWNS * UNKNOWNS, true},
      {"the gradient", gradient_array, 'd', UNKNOWNS, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *jacobian = arrays.views[0].buf, *values = arrays.views[1].buf;
  const double *weights = arrays.views[2].buf;
  double *information = arrays.views[3].buf, *gradient = arrays.views[4].buf;
  Py_BEGIN_ALLOW_THREADS
  add_equations(jacobian, values, weights, count, information, gradient);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// Add the outer products of the gradients of blocks, with the correction for few blocks.
static void add_noise(double (*sums)[UNKNOWNS], const char *has, Py_ssize_t size, double *noise) {
  double products[UNKNOWNS * UNKNOWNS] = {0};
  Py_ssize_t blocks = 0;
  for (Py_ssize_t i = 0; i < size; ++i) {
    if (has[i]) {
      add_outer(sums[i], 1.0, products);
      ++blocks;
    }
  }
  mirror(products);
  const double most = blocks > 6 ? (double)(blocks - 6) : 1.0;
  const double least = blocks > 7 ? (double)(blocks - 7) : 1.0;
  for (int i = 0; i < UNKNOWNS * UNKNOWNS; ++i)
    noise[i] += products[i] * ((double)blocks / most) * ((double)blocks / least);
}

Py_ssize_t end_of_blocks(const Kind *kind) {
  int64_t end = 0;
  for (Py_ssize_t i = 0; i < kind->count; ++i) {
    if (kind->blocks[i] < 0 || kind->blocks[i] >= MOST_BLOCKS) {
      PyErr_SetString(PyExc_ValueError, "a block has a number out of range");
      return -1;
    }
    end = kind->blocks[i] >= end ? kind->blocks[i] + 1 : end;
  }
  return (Py_ssize_t)end;
}

bool add_gradient_noise(const Kind *kind, Py_ssize_t end, const double *error, double *noise) {
  double(*sums)[UNKNOWNS] = calloc((size_t)end + 1, sizeof(*sums));
  char *has = calloc((size_t)end + 1, 1);
  const bool is_memory = sums != NULL && has != NULL;
  for (Py_ssize_t i = 0; is_memory && i < kind->count; ++i) {
    const double *row = kind->jacobian + UNKNOWNS * i;
    const int64_t block = kind->blocks[i];
    double left = kind->values[i];
    for (int k = 0; k < UNKNOWNS; ++k)
      left -= row[k] * error[k];
    has[block] = 1;
    for (int k = 0; k < UNKNOWNS; ++k)
      sums[block][k] += kind->weights[i] * left * row[k];
  }
  if (is_memory)
    add_noise(sums, has, end, noise);
  free(sums);
  free(has);
  return is_memory;
}

PyObject *kernel_gradient_noise(PyObject *module, PyObject *arguments) {
  PyObject *jacobian_array, *value_array, *weight_array, *block_array, *noise_array;
  if (!PyArg_ParseTuple(arguments, "OOOOO", &jacobian_array, &value_array, &weight_array,
                        &block_array, &noise_array))
    return NULL;
  const Py_ssize_t count = row_count(value_array);
  const Argument needed[] = {
      {"the jacobian", jacobian_array, 'd', UNKNOWNS * count, false},
      {"the values", value_array, 'd', count, false},
      {"the weights", weight_array, 'd', count, false},
      {"the blocks", block_array, 'q', count, false},
      {"the noise", noise_array, 'd', UNKNOWNS * UNKNOWNS, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Kind kind = {arrays.views[0].buf, arrays.views[1].buf, arrays.views[2].buf,
                     arrays.views[3].buf, count};
  const Py_ssize_t end = end_of_blocks(&kind);
  const double no_error[UNKNOWNS] = {0.0};
  bool is_done = end >= 0;
  if (is_done) {
    Py_BEGIN_ALLOW_THREADS
    is_done = add_gradient_noise(&kind, end, no_error, arrays.views[4].buf);
    Py_END_ALLOW_THREADS
    if (!is_done)
      PyErr_NoMemory();
  }
  close_arrays(&arrays);
  if (!is_done)
    return NULL;
  Py_RETURN_NONE;
}
