// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Rotations by turn rates.

#include <stdint.h>

#include "arrays.h"
#include "kernels.h"
#include "se3.h"

static const double NANOSECOND = 1e-9;  // s, by definition

// Advance a rotation and its integral by an interval [s] of a constant turn rate.
static void advance(const double *rotation, const double *integral, const double *rate,
                    double interval, double *later, double *later_integral) {
  double half[9], by_half[9], middle[9];
  for (int i = 0; i < 3; ++i)
    half[i] = 0.5 * interval * rate[i];
  exp_rotation(half, by_half);
  multiply(rotation, by_half, middle);
  multiply(middle, by_half, later);
  for (int i = 0; i < 9; ++i)
    later_integral[i] = integral[i] + interval * middle[i];
}

PyObject *kernel_integrate_turns(PyObject *module, PyObject *arguments) {
  PyObject *objects[4];
  if (!PyArg_ParseTuple(arguments, "OOOO", &objects[0], &objects[1], &objects[2], &objects[3]))
    return NULL;
  const Py_ssize_t count = PyObject_Length(objects[0]);
  const Argument needed[] = {
      {"the stamps", objects[0], 'q', count, false},
      {"the rates", objects[1], 'd', 3 * count, false},
      {"the rotations", objects[2], 'd', 9 * count, true},
      {"the integrals", objects[3], 'd', 9 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const int64_t *stamps = arrays.views[0].buf;
  const double *rates = arrays.views[1].buf;
  double *rotations = arrays.views[2].buf, *integrals = arrays.views[3].buf;
  for (Py_ssize_t k = 1; k < count; ++k) {
    double mean[3];
    for (int i = 0; i < 3; ++i)
      mean[i] = 0.5 * (rates[3 * k - 3 + i] + rates[3 * k + i]);
    // unsigned: the difference of any two stamps is defined
    const int64_t elapsed = (int64_t)((uint64_t)stamps[k] - (uint64_t)stamps[k - 1]);
    advance(rotations + 9 * (k - 1), integrals + 9 * (k - 1), mean,
            NANOSECOND * (double)elapsed, rotations + 9 * k, integrals + 9 * k);
  }
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
