// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// The choice of cells by the directions of their normals.

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"

enum { NO_BUCKET = UINT8_MAX };

// The interval of -1 to 1, one of some of equal width, that a coordinate lies in.
static inline int interval_of(float coordinate, int count) {
  const int interval = (int)((coordinate + 1.0f) * (0.5f * (float)count * (1.0f - 1e-6f)));
  return interval < count ? interval : count - 1;
}

PyObject *kernel_normal_buckets(PyObject *module, PyObject *arguments) {
  PyObject *normal_array, *usable_array, *bucket_array, *size_array;
  int across;
  if (!PyArg_ParseTuple(arguments, "OOiOO", &normal_array, &usable_array, &across, &bucket_array,
                        &size_array))
    return NULL;
  if (across < 1 || across > NO_BUCKET / across) {
    PyErr_SetString(PyExc_ValueError, "the buckets are too many for their numbers");
    return NULL;
  }
  const Py_ssize_t count = row_count(usable_array);
  const Argument needed[] = {
      {"the normals", normal_array, 'f', 3 * count, false},
      {"the usable cells", usable_array, '?', count, false},
      {"the buckets", bucket_array, 'B', count, true},
      {"the sizes", size_array, 'q', across * across, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const float *normals = arrays.views[0].buf;
  const char *usable = arrays.views[1].buf;
  uint8_t *buckets = arrays.views[2].buf;
  int64_t *sizes = arrays.views[3].buf;
  memset(sizes, 0, (size_t)(across * across) * sizeof(*sizes));
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    const float x = normals[3 * i], y = normals[3 * i + 1];
    buckets[i] = NO_BUCKET;
    // a unit vector, but for rounding
    if (usable[i] && fabsf(x) < 1.001f && fabsf(y) < 1.001f) {
      buckets[i] = (uint8_t)(across * interval_of(x, across) + interval_of(y, across));
      ++sizes[buckets[i]];
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// The largest quota per bucket with which all together contribute at most a number of cells.
static Py_ssize_t quota_within(Py_ssize_t most, const int64_t *sizes, Py_ssize_t count) {
  Py_ssize_t quota = 0, larger = 1;
  for (; larger > 0; ++quota) {  // each turn but the last takes one cell at least
    larger = 0;
    for (Py_ssize_t i = 0; i < count; ++i)
      larger += sizes[i] > quota;
    most -= larger;
    if (most < 0)
      break;
  }
  return quota;
}

// Mark the first cells of each bucket in an order, at most a quota of each; false where a number
// is not that of a cell. No branch depends on a bucket: none would be foreseen.
static bool mark_first(const int64_t *order, const uint8_t *buckets, Py_ssize_t count,
                       Py_ssize_t quota, char *is_chosen) {
  Py_ssize_t taken[NO_BUCKET + 1] = {0};
  taken[NO_BUCKET] = quota;
  for (Py_ssize_t i = 0; i < count; ++i) {
    const int64_t cell = order[i];
    if (cell < 0 || cell >= count)
      return false;
    is_chosen[cell] = taken[buckets[cell]]++ < quota;
  }
  return true;
}

PyObject *kernel_choose_cells(PyObject *module, PyObject *arguments) {
  PyObject *order_array, *bucket_array, *size_array, *chosen_array;
  Py_ssize_t most;
  if (!PyArg_ParseTuple(arguments, "OOOnO", &order_array, &bucket_array, &size_array, &most,
                        &chosen_array))
    return NULL;
  if (most < 0 || most > LONGEST) {
    PyErr_SetString(PyExc_ValueError, "the number of cells to choose is out of range");
    return NULL;
  }
  const Py_ssize_t count = row_count(order_array), buckets = row_count(size_array);
  const Argument needed[] = {
      {"the order", order_array, 'q', count, false},
      {"the buckets", bucket_array, 'B', count, false},
      {"the sizes", size_array, 'q', buckets, false},
      {"the chosen cells", chosen_array, '?', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  bool are_cells;
  Py_BEGIN_ALLOW_THREADS
  const Py_ssize_t quota = quota_within(most < count ? most : count, arrays.views[2].buf, buckets);
  are_cells = mark_first(arrays.views[0].buf, arrays.views[1].buf, count, quota,
                         arrays.views[3].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_cells) {
    PyErr_SetString(PyExc_ValueError, "a number of the order is not that of a cell");
    return NULL;
  }
  Py_RETURN_NONE;
}
