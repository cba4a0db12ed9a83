// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Keypoints tracked from one frame to another.

#include <math.h>
#include <stdint.h>

#include "arrays.h"
#include "kernels.h"
#include "sensor.h"

PyObject *kernel_visible(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *pixel_array, *index_array, *found_array;
  double nearest;
  Py_ssize_t width, height;
  if (!PyArg_ParseTuple(arguments, "OOdnnOO", &point_array, &pixel_array, &nearest, &width,
                        &height, &index_array, &found_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the indices", index_array, 'q', count, true},
      {"the pixels found", found_array, 'f', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double(*points)[3] = arrays.views[0].buf, (*pixels)[2] = arrays.views[1].buf;
  const double last_column = (double)width - 1.0, last_row = (double)height - 1.0;
  int64_t *indices = arrays.views[2].buf;
  float(*found)[2] = arrays.views[3].buf;
  Py_ssize_t visible = 0;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    const double u = pixels[i][0], v = pixels[i][1];
    if (points[i][2] > nearest && u >= 0.0 && u <= last_column && v >= 0.0 && v <= last_row) {
      indices[visible] = i;
      found[visible][0] = (float)u;
      found[visible++][1] = (float)v;
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(visible);
}

PyObject *kernel_mean_displacement(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array;
  if (!PyArg_ParseTuple(arguments, "OO", &point_array, &ray_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the rays", ray_array, 'd', 2 * count, false},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double(*points)[3] = arrays.views[0].buf, (*rays)[2] = arrays.views[1].buf;
  double sum = 0.0;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    const double u = rays[i][0] - points[i][0] / points[i][2];
    const double v = rays[i][1] - points[i][1] / points[i][2];
    sum += sqrt(u * u + v * v);
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyFloat_FromDouble(count ? sum / (double)count : 0.0);
}

typedef struct {
  const int64_t *keypoints;
  const double (*points)[3], (*rays)[2], *depths, *sigmas;
  Py_ssize_t count;
} Tracks;

typedef struct {
  int64_t *keypoints;
  double (*points)[3], (*rays)[2], *depths, *sigmas;
} NewTracks;

// Swap the frames of those tracks that have a depth in the second one; return how many they are.
static Py_ssize_t reverse(const Tracks *from, double sigma, double exponent, NewTracks *to) {
  Py_ssize_t found = 0;
  for (Py_ssize_t i = 0; i < from->count; ++i) {
    const double depth = from->depths[i], z = from->points[i][2];
    if (!isfinite(depth))
      continue;
    const double noise = inverse_depth_sigma(depth, sigma, exponent);
    to->keypoints[found] = from->keypoints[i];
    for (int k = 0; k < 2; ++k) {
      to->points[found][k] = from->rays[i][k] * depth;
      to->rays[found][k] = from->points[i][k] / z;
    }
    to->points[found][2] = depth;
    to->depths[found] = z;
    to->sigmas[found] = noise > from->sigmas[i] ? noise : from->sigmas[i];
    ++found;
  }
  return found;
}

PyObject *kernel_reversed_tracks(PyObject *module, PyObject *arguments) {
  PyObject *objects[10];
  double sigma, exponent;
  if (!PyArg_ParseTuple(arguments, "OOOOOddOOOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &sigma, &exponent, &objects[5], &objects[6],
                        &objects[7], &objects[8], &objects[9]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]);
  const Argument needed[] = {
      {"the keypoints", objects[0], 'q', count, false},
      {"the points", objects[1], 'd', 3 * count, false},
      {"the rays", objects[2], 'd', 2 * count, false},
      {"the depths", objects[3], 'd', count, false},
      {"the sigmas", objects[4], 'd', count, false},
      {"the keypoints reversed", objects[5], 'q', count, true},
      {"the points reversed", objects[6], 'd', 3 * count, true},
      {"the rays reversed", objects[7], 'd', 2 * count, true},
      {"the depths reversed", objects[8], 'd', count, true},
      {"the sigmas reversed", objects[9], 'd', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Tracks from = {views[0].buf, views[1].buf, views[2].buf, views[3].buf, views[4].buf,
                       count};
  NewTracks to = {views[5].buf, views[6].buf, views[7].buf, views[8].buf, views[9].buf};
  Py_ssize_t found;
  Py_BEGIN_ALLOW_THREADS
  found = reverse(&from, sigma, exponent, &to);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}
