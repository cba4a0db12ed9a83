// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Covariances of a Kalman filter; matrices row by row.

#include "kalman.h"

#include <string.h>

#include "arrays.h"
#include "cholesky.h"
#include "kernels.h"
#include "products.h"

// Whether matrices of these sizes are small enough; else there is an exception.
static bool are_few(Py_ssize_t size, Py_ssize_t count) {
  if (size <= MOST_VALUES && count <= MOST_VALUES)
    return true;
  PyErr_Format(PyExc_ValueError, "a filter has at most %d values", MOST_VALUES);
  return false;
}

static void transpose(const double *matrix, Py_ssize_t height, Py_ssize_t width,
                      double *transposed) {
  for (Py_ssize_t i = 0; i < height; ++i)
    for (Py_ssize_t j = 0; j < width; ++j)
      transposed[height * j + i] = matrix[width * i + j];
}

// Add M C M^T to a covariance; M is height x width.
static void add_propagated(const double *matrix, const double *covariance, Py_ssize_t height,
                           Py_ssize_t width, double *sum) {
  double left[MOST_VALUES * MOST_VALUES] = {0}, transposed[MOST_VALUES * MOST_VALUES];
  add_product(matrix, covariance, height, width, width, 1.0, left);
  transpose(matrix, height, width, transposed);
  add_product(left, transposed, height, width, height, 1.0, sum);
}

void propagate(const double *transition, const double *covariance, const double *influence,
               const double *noise, Py_ssize_t size, Py_ssize_t count, double *result) {
  double sum[MOST_VALUES * MOST_VALUES] = {0};
  add_propagated(transition, covariance, size, size, sum);
  add_propagated(influence, noise, size, count, sum);
  for (Py_ssize_t i = 0; i < size; ++i)
    for (Py_ssize_t j = 0; j < size; ++j)
      result[size * i + j] = 0.5 * (sum[size * i + j] + sum[size * j + i]);
}

// A measurement of some values by a filter, and what it changes.
typedef struct {
  Py_ssize_t size, count;
  const double *prior, *rows, *noise;
  double *expected, *gain, *kept, *covariance;
} Update;

// Fill the expected covariance with its factor, and the gain; return false where there is none.
static bool fill_gain(const Update *update, double *factor) {
  const Py_ssize_t size = update->size, count = update->count;
  double seen[MOST_VALUES * MOST_VALUES] = {0};
  const size_t bytes = (size_t)(count * count) * sizeof(*factor);
  add_product(update->rows, update->prior, count, size, size, 1.0, seen);
  memcpy(update->expected, update->noise, bytes);
  transpose(update->rows, count, size, factor);
  add_product(seen, factor, count, size, count, 1.0, update->expected);
  memcpy(factor, update->expected, bytes);
  if (!factorize(factor, count))
    return false;
  substitute(factor, count, seen, size);
  transpose(seen, count, size, update->gain);
  return true;
}

// Fill the covariance afterwards in the form of Joseph, which stays positive definite.
static void fill_covariance(const Update *update) {
  const Py_ssize_t size = update->size, count = update->count;
  double product[MOST_VALUES * MOST_VALUES] = {0};
  add_product(update->gain, update->rows, size, count, size, 1.0, product);
  for (Py_ssize_t i = 0; i < size; ++i)
    for (Py_ssize_t j = 0; j < size; ++j)
      update->kept[size * i + j] = (i == j) - product[size * i + j];
  propagate(update->kept, update->prior, update->gain, update->noise, size, count,
            update->covariance);
}

PyObject *kernel_kalman_update(PyObject *module, PyObject *arguments) {
  PyObject *objects[7];
  if (!PyArg_ParseTuple(arguments, "OOOOOOO", &objects[0], &objects[1], &objects[2], &objects[3],
                        &objects[4], &objects[5], &objects[6]))
    return NULL;
  const Py_ssize_t size = row_count(objects[0]), count = row_count(objects[2]);
  if (!are_few(size, count))
    return NULL;
  const Argument needed[] = {
      {"the covariance", objects[0], 'd', size * size, false},
      {"the rows", objects[1], 'd', count * size, false},
      {"the noise", objects[2], 'd', count * count, false},
      {"the expected covariance", objects[3], 'd', count * count, true},
      {"the gain", objects[4], 'd', size * count, true},
      {"the share kept", objects[5], 'd', size * size, true},
      {"the updated covariance", objects[6], 'd', size * size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Update update = {size,         count,        views[0].buf, views[1].buf, views[2].buf,
                         views[3].buf, views[4].buf, views[5].buf, views[6].buf};
  double factor[MOST_VALUES * MOST_VALUES];
  const bool is_definite = fill_gain(&update, factor);
  if (is_definite)
    fill_covariance(&update);
  close_arrays(&arrays);
  return PyBool_FromLong(is_definite);
}

// The square of an error by its covariance, of which a factor is given.
static double squared_distance(const double *factor, const double *error, Py_ssize_t count) {
  double solution[MOST_VALUES], sum = 0.0;
  memcpy(solution, error, (size_t)count * sizeof(*solution));
  substitute(factor, count, solution, 1);
  for (Py_ssize_t i = 0; i < count; ++i)
    sum += error[i] * solution[i];
  return sum;
}

// Update values by an error of what is measured of them; return false, and change nothing, where
// its squared distance is not at most the largest one.
static bool measure(const Update *update, const double *values, const double *error,
                    double largest, double *updated) {
  const Py_ssize_t size = update->size, count = update->count;
  double factor[MOST_VALUES * MOST_VALUES];
  if (!fill_gain(update, factor) || !(squared_distance(factor, error, count) <= largest))
    return false;
  memcpy(updated, values, (size_t)size * sizeof(*updated));
  add_product(update->gain, error, size, count, 1, 1.0, updated);
  fill_covariance(update);
  return true;
}

PyObject *kernel_kalman_measurement(PyObject *module, PyObject *arguments) {
  PyObject *objects[7];
  double largest;
  if (!PyArg_ParseTuple(arguments, "OOOOOdOO", &objects[0], &objects[1], &objects[2], &objects[3],
                        &objects[4], &largest, &objects[5], &objects[6]))
    return NULL;
  const Py_ssize_t size = row_count(objects[0]), count = row_count(objects[4]);
  if (!are_few(size, count))
    return NULL;
  const Argument needed[] = {
      {"the values", objects[0], 'd', size, false},
      {"the covariance", objects[1], 'd', size * size, false},
      {"the rows", objects[2], 'd', count * size, false},
      {"the noise", objects[3], 'd', count * count, false},
      {"the error", objects[4], 'd', count, false},
      {"the updated values", objects[5], 'd', size, true},
      {"the updated covariance", objects[6], 'd', size * size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  double expected[MOST_VALUES * MOST_VALUES], gain[MOST_VALUES * MOST_VALUES];
  double kept[MOST_VALUES * MOST_VALUES];
  const Update update = {size,     count, views[1].buf, views[2].buf, views[3].buf,
                         expected, gain,  kept,         views[6].buf};
  const bool is_near =
      measure(&update, views[0].buf, views[4].buf, largest, views[5].buf);
  close_arrays(&arrays);
  return PyBool_FromLong(is_near);
}

PyObject *kernel_propagated_covariance(PyObject *module, PyObject *arguments) {
  PyObject *transition_array, *prior_array, *influence_array, *noise_array, *result_array;
  if (!PyArg_ParseTuple(arguments, "OOOOO", &transition_array, &prior_array, &influence_array,
                        &noise_array, &result_array))
    return NULL;
  const Py_ssize_t size = row_count(prior_array), count = row_count(noise_array);
  if (!are_few(size, count))
    return NULL;
  const Argument needed[] = {
      {"the transition", transition_array, 'd', size * size, false},
      {"the covariance", prior_array, 'd', size * size, false},
      {"the influence", influence_array, 'd', size * count, false},
      {"the noise", noise_array, 'd', count * count, false},
      {"the result", result_array, 'd', size * size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  propagate(arrays.views[0].buf, arrays.views[1].buf, arrays.views[2].buf, arrays.views[3].buf,
            size, count, arrays.views[4].buf);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
