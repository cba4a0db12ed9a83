// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Errors of a motion by those of its two stamps.

#include <string.h>

#include "arrays.h"
#include "kernels.h"
#include "se3.h"
#include "vectors.h"

enum { UNKNOWNS = 6, FRAMES = 2, PARTS = 2 };

// By how much a motion differs if its source, or its target, is taken later. Signs do not matter:
// errors of two stamps are independent. Twists are those of the bodies of the two frames; where
// one is NULL both are that of the motion over its interval, none over no time.
static void find_rates(const double *motion, const double *source, const double *target,
                       double interval, double rates[FRAMES][UNKNOWNS]) {
  memset(rates, 0, FRAMES * sizeof(*rates));
  if (interval == 0.0)
    return;
  double rotation[9], arm[3];
  for (int i = 0; i < 3; ++i) {
    arm[i] = motion[4 * i + 3];
    memcpy(rotation + 3 * i, motion + 4 * i, 3 * sizeof(*rotation));
  }
  if (source == NULL || target == NULL) {
    double theta[3];
    log_rotation(rotation, theta);
    for (int i = 0; i < 3; ++i) {
      rates[0][i] = rates[1][i] = arm[i] / interval;
      rates[0][3 + i] = rates[1][3 + i] = theta[i] / interval;
    }
    return;
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    rates[0][i] = dot(rotation + 3 * i, source);
    rates[0][3 + i] = dot(rotation + 3 * i, source + 3);
    rates[1][i] = target[i] + target[3 + j] * arm[k] - target[3 + k] * arm[j];
    rates[1][3 + i] = target[3 + i];
  }
}

PyObject *kernel_stamp_errors(PyObject *module, PyObject *arguments) {
  PyObject *motion_array, *source_array, *target_array, *changes_array, *covariance_array;
  double interval, stamp_variance, latency_variance;
  if (!PyArg_ParseTuple(arguments, "OOOOdddO", &motion_array, &source_array, &target_array,
                        &changes_array, &interval, &stamp_variance, &latency_variance,
                        &covariance_array))
    return NULL;
  const Argument needed[] = {
      {"the motion", motion_array, 'd', 16, false},
      {"the twist of the source", source_array, 'd', UNKNOWNS, false, true},
      {"the twist of the target", target_array, 'd', UNKNOWNS, false, true},
      {"the squares of the changes", changes_array, 'd', PARTS, false},
      {"the covariance", covariance_array, 'd', UNKNOWNS * UNKNOWNS, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  double rates[FRAMES][UNKNOWNS];
  find_rates(arrays.views[0].buf, arrays.views[1].buf, arrays.views[2].buf, interval, rates);
  const double *squares = arrays.views[3].buf;
  double(*covariance)[UNKNOWNS] = arrays.views[4].buf;
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      covariance[i][j] = stamp_variance * (rates[0][i] * rates[0][j] + rates[1][i] * rates[1][j]) +
                         (i == j ? latency_variance * squares[PARTS * i / UNKNOWNS] : 0.0);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
