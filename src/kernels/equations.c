// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Sums over residuals, six unknowns each.

#include "equations.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "arrays.h"
#include "cholesky.h"
#include "kernels.h"
#include "processors.h"
#include "products.h"

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

PyObject *kernel_gradient_noise(PyObject *module, PyObject *arguments) {
  PyObject *jacobian_array, *value_array, *weight_array, *block_array, *error_array, *noise_array;
  if (!PyArg_ParseTuple(arguments, "OOOOOO", &jacobian_array, &value_array, &weight_array,
                        &block_array, &error_array, &noise_array))
    return NULL;
  const Py_ssize_t count = row_count(value_array);
  const Argument needed[] = {
      {"the jacobian", jacobian_array, 'd', UNKNOWNS * count, false},
      {"the values", value_array, 'd', count, false},
      {"the weights", weight_array, 'd', count, false},
      {"the blocks", block_array, 'q', count, false},
      {"the error", error_array, 'd', UNKNOWNS, false},
      {"the noise", noise_array, 'd', UNKNOWNS * UNKNOWNS, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *jacobian = arrays.views[0].buf, *values = arrays.views[1].buf;
  const double *weights = arrays.views[2].buf, *error = arrays.views[4].buf;
  const int64_t *blocks = arrays.views[3].buf;
  int64_t size = 0;
  for (Py_ssize_t i = 0; i < count; ++i) {
    if (blocks[i] < 0 || blocks[i] >= MOST_BLOCKS) {
      close_arrays(&arrays);
      PyErr_SetString(PyExc_ValueError, "a block has a number out of range");
      return NULL;
    }
    size = blocks[i] >= size ? blocks[i] + 1 : size;
  }
  double(*sums)[UNKNOWNS] = calloc((size_t)size + 1, sizeof(*sums));
  char *has = calloc((size_t)size + 1, 1);
  if (sums != NULL && has != NULL) {
    Py_BEGIN_ALLOW_THREADS
    for (Py_ssize_t i = 0; i < count; ++i) {
      const double *row = jacobian + UNKNOWNS * i;
      double left = values[i];
      for (int k = 0; k < UNKNOWNS; ++k)
        left -= row[k] * error[k];
      has[blocks[i]] = 1;
      for (int k = 0; k < UNKNOWNS; ++k)
        sums[blocks[i]][k] += weights[i] * left * row[k];
    }
    add_noise(sums, has, (Py_ssize_t)size, arrays.views[5].buf);
    Py_END_ALLOW_THREADS
  } else {
    PyErr_NoMemory();
  }
  const bool is_done = sums != NULL && has != NULL;
  free(sums);
  free(has);
  close_arrays(&arrays);
  if (!is_done)
    return NULL;
  Py_RETURN_NONE;
}

typedef double Matrix[UNKNOWNS][UNKNOWNS];

// Add the product of two matrices, times a factor, to a third one.
static void add_square_product(const double *a, const double *b, double factor, Matrix sum) {
  add_product(a, b, UNKNOWNS, UNKNOWNS, UNKNOWNS, factor, *sum);
}

// What a bias of the unknowns with a diagonal covariance, marginalised, multiplies equations by:
// I - A R (I + R A R)^-1 R, R the root of the covariance; NaN where there is none.
static void find_damping(const Matrix information, double weight, const Matrix bias,
                         Matrix damping) {
  double root[UNKNOWNS];
  Matrix factor, gains = {{0.0}}, seen;
  for (int i = 0; i < UNKNOWNS; ++i)
    gains[i][i] = root[i] = sqrt(bias[i][i]);
  for (int i = 0; i < UNKNOWNS; ++i) {
    for (int j = 0; j < UNKNOWNS; ++j) {
      seen[i][j] = weight * information[i][j] * root[j];
      factor[i][j] = (i == j) + root[i] * seen[i][j];
      damping[i][j] = i == j;
    }
  }
  if (factorize(*factor, UNKNOWNS))
    substitute(*factor, UNKNOWNS, *gains, UNKNOWNS);
  else
    gains[0][0] = NAN;
  add_square_product(*seen, *gains, -1.0, damping);
}

PyObject *kernel_marginal_equations(PyObject *module, PyObject *arguments) {
  PyObject *objects[7];
  double weight;
  if (!PyArg_ParseTuple(arguments, "OOOdOOOO", &objects[0], &objects[1], &objects[2], &weight,
                        &objects[3], &objects[4], &objects[5], &objects[6]))
    return NULL;
  const Py_ssize_t size = UNKNOWNS * UNKNOWNS;
  const Argument needed[] = {
      {"the information", objects[0], 'd', size, false},
      {"the gradient", objects[1], 'd', UNKNOWNS, false},
      {"the noise", objects[2], 'd', size, false},
      {"the bias", objects[3], 'd', size, false},
      {"the marginal information", objects[4], 'd', size, true},
      {"the marginal gradient", objects[5], 'd', UNKNOWNS, true},
      {"the marginal noise", objects[6], 'd', size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const double(*information)[UNKNOWNS] = views[0].buf, *gradient = views[1].buf;
  double(*marginal)[UNKNOWNS] = views[4].buf, *slopes = views[5].buf;
  double(*noise)[UNKNOWNS] = views[6].buf;
  Matrix damping, transposed, gains = {{0.0}};
  find_damping(information, weight, views[3].buf, damping);
  for (int i = 0; i < UNKNOWNS; ++i) {
    slopes[i] = 0.0;
    for (int j = 0; j < UNKNOWNS; ++j) {
      slopes[i] += weight * damping[i][j] * gradient[j];
      marginal[i][j] = noise[i][j] = 0.0;
      transposed[j][i] = damping[i][j];
    }
  }
  add_square_product(*damping, *information, weight, marginal);
  add_square_product(*damping, views[2].buf, weight * weight, gains);
  add_square_product(*gains, *transposed, 1.0, noise);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
