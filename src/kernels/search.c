// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// The search for the closest keypoints. Points are rows of four floats, (x, y, z, 1).

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "arrays.h"
#include "kernels.h"
#include "pairs.h"
#include "processors.h"

enum { STRIDE = 4 };  // floats of a point

static inline float squared_distance(float x, float y, float z) {
  return (x * x + y * y) + z * z;
}

// Pairs that may match, sorted by source, then by target.
typedef struct {
  const float *moved, *target, *descriptor_distances;
  const int64_t *sources, *targets;
  Py_ssize_t moved_count, target_count, count;
} Candidates;

// List the target with the smallest d below a threshold of each source, the first of equals;
// return their number, -1 where a row is not one of the points or the sources descend.
static Py_ssize_t list_closest(const Candidates *c, float position_weight,
                               float descriptor_weight, float threshold, int64_t (*matches)[2]) {
  Py_ssize_t found = 0, k = 0;
  int64_t last = -1;
  while (k < c->count) {
    const int64_t source = c->sources[k];
    if (source <= last || source >= c->moved_count)
      return -1;
    last = source;
    const float *a = c->moved + STRIDE * source;
    float least = threshold;
    int64_t closest = -1;
    for (; k < c->count && c->sources[k] == source; ++k) {
      const int64_t target = c->targets[k];
      if (target < 0 || target >= c->target_count)
        return -1;
      const float *b = c->target + STRIDE * target;
      const float d_e = sqrtf(squared_distance(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
      const float d = position_weight * d_e + descriptor_weight * c->descriptor_distances[k];
      if (d < least) {
        least = d;
        closest = target;
      }
    }
    if (closest >= 0) {
      matches[found][0] = source;
      matches[found++][1] = closest;
    }
  }
  return found;
}

PyObject *kernel_closest_pairs(PyObject *module, PyObject *arguments) {
  PyObject *moved_array, *target_array, *row_array, *distance_array, *match_array;
  float position_weight, descriptor_weight, threshold;
  if (!PyArg_ParseTuple(arguments, "OOOOfffO", &moved_array, &target_array, &row_array,
                        &distance_array, &position_weight, &descriptor_weight, &threshold,
                        &match_array))
    return NULL;
  Candidates c;
  c.moved_count = row_count(moved_array);
  c.target_count = row_count(target_array);
  c.count = row_count(distance_array);
  const Argument needed[] = {
      {"the moved points", moved_array, 'f', STRIDE * c.moved_count, false},
      {"the target", target_array, 'f', STRIDE * c.target_count, false},
      {"the rows", row_array, 'q', 2 * c.count, false},
      {"the distances", distance_array, 'f', c.count, false},
      {"the matches", match_array, 'q', 2 * c.moved_count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  c.moved = arrays.views[0].buf;
  c.target = arrays.views[1].buf;
  c.sources = arrays.views[2].buf;
  c.targets = c.sources + c.count;
  c.descriptor_distances = arrays.views[3].buf;
  int64_t(*matches)[2] = arrays.views[4].buf;
  Py_ssize_t found;
  Py_BEGIN_ALLOW_THREADS
  found = list_closest(&c, position_weight, descriptor_weight, threshold, matches);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (found < 0) {
    PyErr_SetString(PyExc_ValueError, "a row of a pair is not one of the points, or the pairs "
                                      "are not sorted by source");
    return NULL;
  }
  return PyLong_FromSsize_t(found);
}

// Copy points to arrays of x, y and z, so that the loop over them is vectorised.
static void separate(const float *points, Py_ssize_t count, float *separated) {
  for (int axis = 0; axis < 3; ++axis)
    for (Py_ssize_t i = 0; i < count; ++i)
      *separated++ = points[STRIDE * i + axis];
}

FOR_EACH_PROCESSOR
static void squared_distances(const float *point, const float *x, const float *y, const float *z,
                              Py_ssize_t count, float *squares) {
  for (Py_ssize_t j = 0; j < count; ++j)
    squares[j] = squared_distance(point[0] - x[j], point[1] - y[j], point[2] - z[j]);
}

// List the pairs of points that are nearer than a radius; scratch has four floats per target.
static bool list_near(const float *moved, Py_ssize_t count, const float *target,
                      Py_ssize_t target_count, float radius, float *scratch, Pairs *pairs) {
  const float *x = scratch, *y = x + target_count, *z = y + target_count;
  float *squares = scratch + 3 * target_count;
  separate(target, target_count, scratch);
  for (Py_ssize_t i = 0; i < count; ++i) {
    squared_distances(moved + STRIDE * i, x, y, z, target_count, squares);
    if (!add_below(pairs, i, squares, target_count, radius * radius))
      return false;
  }
  return true;
}

PyObject *kernel_pairs_of_near_points(PyObject *module, PyObject *arguments) {
  PyObject *moved_array, *target_array;
  float radius;
  if (!PyArg_ParseTuple(arguments, "OOf", &moved_array, &target_array, &radius))
    return NULL;
  const Py_ssize_t count = row_count(moved_array);
  const Py_ssize_t target_count = row_count(target_array);
  const Argument needed[] = {
      {"the moved points", moved_array, 'f', STRIDE * count, false},
      {"the target", target_array, 'f', STRIDE * target_count, false},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const float *moved = arrays.views[0].buf, *target = arrays.views[1].buf;
  float *scratch = malloc((size_t)(4 * target_count + 1) * sizeof(*scratch));
  Pairs pairs = {0};
  bool is_complete = scratch != NULL;
  if (is_complete) {
    Py_BEGIN_ALLOW_THREADS
    is_complete = list_near(moved, count, target, target_count, radius, scratch, &pairs);
    Py_END_ALLOW_THREADS
  }
  free(scratch);
  close_arrays(&arrays);
  return take_pairs(&pairs, is_complete);
}
