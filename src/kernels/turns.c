// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Rotations by turn rates.

#include <stdint.h>

#include "arrays.h"
#include "kernels.h"
#include "se3.h"

static const double NANOSECOND = 1e-9;  // s, by definition

// A rotation, its integral, and that of its products with the turn rate.
typedef struct {
  double *rotation, *integral, *products;
} State;

static State state_at(const Arrays *arrays, Py_ssize_t k) {
  return (State){(double *)arrays->views[2].buf + 9 * k, (double *)arrays->views[3].buf + 9 * k,
                 (double *)arrays->views[4].buf + 27 * k};
}

// Advance by an interval [s] of a constant turn rate.
static void advance(State from, const double *rate, double interval, State to) {
  double half[9], by_half[9], middle[9];
  for (int i = 0; i < 3; ++i)
    half[i] = 0.5 * interval * rate[i];
  exp_rotation(half, by_half);
  multiply(from.rotation, by_half, middle);
  multiply(middle, by_half, to.rotation);
  for (int i = 0; i < 9; ++i) {
    to.integral[i] = from.integral[i] + interval * middle[i];
    for (int k = 0; k < 3; ++k)
      to.products[3 * i + k] = from.products[3 * i + k] + interval * middle[i] * rate[k];
  }
}

PyObject *kernel_integrate_turns(PyObject *module, PyObject *arguments) {
  PyObject *objects[5];
  if (!PyArg_ParseTuple(arguments, "OOOOO", &objects[0], &objects[1], &objects[2], &objects[3],
                        &objects[4]))
    return NULL;
  const Py_ssize_t count = PyObject_Length(objects[0]);
  const Argument needed[] = {
      {"the stamps", objects[0], 'q', count, false},
      {"the rates", objects[1], 'd', 3 * count, false},
      {"the rotations", objects[2], 'd', 9 * count, true},
      {"the integrals", objects[3], 'd', 9 * count, true},
      {"the integrals of the products", objects[4], 'd', 27 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const int64_t *stamps = arrays.views[0].buf;
  const double *rates = arrays.views[1].buf;
  for (Py_ssize_t k = 1; k < count; ++k) {
    double mean[3];
    for (int i = 0; i < 3; ++i)
      mean[i] = 0.5 * (rates[3 * k - 3 + i] + rates[3 * k + i]);
    // unsigned: the difference of any two stamps is defined
    const int64_t elapsed = (int64_t)((uint64_t)stamps[k] - (uint64_t)stamps[k - 1]);
    advance(state_at(&arrays, k - 1), mean, NANOSECOND * (double)elapsed, state_at(&arrays, k));
  }
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
