// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Integrals of specific forces.

#include <stdint.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"
#include "se3.h"

static const double NANOSECOND = 1e-9;  // s, by definition

enum { INTEGRANDS = 12 };  // the force in the fixed axes, and the rotation from those of the body

typedef struct {
  const double *first;  // orientation at the start
  double turn[3];       // rotation vector from there to the orientation at the end
  int64_t start;
  double duration;
} Turning;

typedef struct {
  double time;  // since the start [s]
  double integrands[INTEGRANDS];
} Moment;

// unsigned: the difference of any two stamps is defined
static double elapsed(int64_t start, int64_t end) {
  return NANOSECOND * (double)(int64_t)((uint64_t)end - (uint64_t)start);
}

// The force at a stamp, between two samples in a row, or that of the nearest one.
static void force_at(int64_t stamp, const int64_t *stamps, const double *forces, Py_ssize_t count,
                     double *force) {
  Py_ssize_t after = 0;
  while (after < count - 1 && stamps[after] < stamp)
    ++after;
  const bool is_between = after > 0 && stamps[after] >= stamp;
  const double *later = forces + 3 * after, *earlier = is_between ? later - 3 : later;
  const double share = is_between ? elapsed(stamps[after - 1], stamp) /
                                        elapsed(stamps[after - 1], stamps[after])
                                  : 1.0;
  for (int i = 0; i < 3; ++i)
    force[i] = earlier[i] + share * (later[i] - earlier[i]);
}

static Moment moment_of(const Turning *turning, int64_t stamp, const double *force) {
  Moment moment = {.time = elapsed(turning->start, stamp)};
  double part[3], turned[9], *rotation = moment.integrands + 3;
  for (int i = 0; i < 3; ++i)
    part[i] = turning->turn[i] * (moment.time / turning->duration);
  exp_rotation(part, turned);
  multiply(turning->first, turned, rotation);
  for (int i = 0; i < 3; ++i)
    moment.integrands[i] = rotation[3 * i] * force[0] + rotation[3 * i + 1] * force[1] +
                           rotation[3 * i + 2] * force[2];
  return moment;
}

// Add the interval between two moments, by the trapezoid, to the integral and the double one.
static void add_interval(const Moment *one, const Moment *other, double duration, double *sums) {
  const double half = 0.5 * (other->time - one->time);
  for (int i = 0; i < INTEGRANDS; ++i) {
    sums[i] += half * (one->integrands[i] + other->integrands[i]);
    sums[INTEGRANDS + i] += half * ((duration - one->time) * one->integrands[i] +
                                    (duration - other->time) * other->integrands[i]);
  }
}

static void integrate(const int64_t *stamps, const double *forces, Py_ssize_t count, int64_t end,
                      const Turning *turning, double *sums) {
  double force[3];
  force_at(turning->start, stamps, forces, count, force);
  Moment before = moment_of(turning, turning->start, force);
  memset(sums, 0, 2 * INTEGRANDS * sizeof(*sums));
  for (Py_ssize_t k = 0; k < count; ++k) {
    if (stamps[k] <= turning->start || stamps[k] >= end)
      continue;
    const Moment moment = moment_of(turning, stamps[k], forces + 3 * k);
    add_interval(&before, &moment, turning->duration, sums);
    before = moment;
  }
  force_at(end, stamps, forces, count, force);
  const Moment last = moment_of(turning, end, force);
  add_interval(&before, &last, turning->duration, sums);
}

PyObject *kernel_integrate_forces(PyObject *module, PyObject *arguments) {
  PyObject *stamp_array, *force_array, *first_array, *last_array, *sum_array;
  long long start, end;
  if (!PyArg_ParseTuple(arguments, "OOLLOOO", &stamp_array, &force_array, &start, &end,
                        &first_array, &last_array, &sum_array))
    return NULL;
  const Py_ssize_t count = row_count(stamp_array);
  const Argument needed[] = {
      {"the stamps", stamp_array, 'q', count, false},
      {"the forces", force_array, 'd', 3 * count, false},
      {"the first orientation", first_array, 'd', 9, false},
      {"the last orientation", last_array, 'd', 9, false},
      {"the sums", sum_array, 'd', 2 * INTEGRANDS, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  if (count == 0) {
    PyErr_SetString(PyExc_ValueError, "there are no forces");
    close_arrays(&arrays);
    return NULL;
  }
  Turning turning = {arrays.views[2].buf, {0}, start, elapsed(start, end)};
  const double *first = turning.first;
  const double back[9] = {first[0], first[3], first[6], first[1], first[4],
                          first[7], first[2], first[5], first[8]};
  double relative[9];
  multiply(back, arrays.views[3].buf, relative);
  log_rotation(relative, turning.turn);
  integrate(arrays.views[0].buf, arrays.views[1].buf, count, end, &turning, arrays.views[4].buf);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
