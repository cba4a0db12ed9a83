// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Keypoints tracked from one frame to another.

#include <math.h>
#include <stdint.h>

#include "arrays.h"
#include "camera_model.h"
#include "kernels.h"
#include "processors.h"
#include "sensor.h"
#include "vectors.h"

// What a camera sees.
typedef struct {
  CameraModel camera;
  double nearest;
} View;

// Write which points a pose puts in view, and their pixels; return how many there are.
FOR_EACH_PROCESSOR
static Py_ssize_t list_visible(const View *view, const double *pose, const double (*points)[3],
                               Py_ssize_t count, int64_t *indices, float (*found)[2]) {
  const double last_column = view->camera.width - 1.0, last_row = view->camera.height - 1.0;
  Py_ssize_t visible = 0;
  for (Py_ssize_t first = 0; first < count; first += FOUR) {
    const int many = count - first < FOUR ? (int)(count - first) : FOUR;
    double moved[FOUR][3], pixels[FOUR][2];
    for (int n = 0; n < many; ++n)
      transform(pose, points[first + n], moved[n]);
    project(*moved, many, &view->camera, *pixels);
    for (int n = 0; n < many; ++n) {
      const double u = pixels[n][0], v = pixels[n][1];
      if (moved[n][2] > view->nearest && u >= 0.0 && u <= last_column && v >= 0.0 &&
          v <= last_row) {
        indices[visible] = first + n;
        found[visible][0] = (float)u;
        found[visible++][1] = (float)v;
      }
    }
  }
  return visible;
}

PyObject *kernel_visible(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *pose_array, *camera_array, *index_array, *found_array;
  View view;
  if (!PyArg_ParseTuple(arguments, "OOOdOO", &point_array, &pose_array, &camera_array,
                        &view.nearest, &index_array, &found_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the camera", camera_array, 'd', CAMERA, false},
      {"the indices", index_array, 'q', count, true},
      {"the pixels found", found_array, 'f', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  view.camera = camera_of(arrays.views[2].buf);
  Py_ssize_t visible;
  Py_BEGIN_ALLOW_THREADS
  visible = list_visible(&view, arrays.views[1].buf, arrays.views[0].buf, count,
                         arrays.views[3].buf, arrays.views[4].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(visible);
}

PyObject *kernel_agreeing_tracks(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array, *pose_array;
  double most;
  if (!PyArg_ParseTuple(arguments, "OOOd", &point_array, &ray_array, &pose_array, &most))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the rays", ray_array, 'd', 2 * count, false},
      {"the pose", pose_array, 'd', 16, false},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double(*points)[3] = arrays.views[0].buf, (*rays)[2] = arrays.views[1].buf;
  const double *pose = arrays.views[2].buf;
  Py_ssize_t agreeing = 0;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    double moved[3];
    transform(pose, points[i], moved);
    agreeing += hypot(moved[0] / moved[2] - rays[i][0], moved[1] / moved[2] - rays[i][1]) < most;
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(agreeing);
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
static Py_ssize_t reverse(const Tracks *from, const DepthNoise *depth_noise, NewTracks *to) {
  Py_ssize_t found = 0;
  for (Py_ssize_t i = 0; i < from->count; ++i) {
    const double depth = from->depths[i], z = from->points[i][2];
    if (!isfinite(depth))
      continue;
    const double noise = inverse_depth_sigma(depth, *depth_noise);
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
  PyObject *objects[11];
  if (!PyArg_ParseTuple(arguments, "OOOOOOOOOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &objects[5], &objects[6], &objects[7],
                        &objects[8], &objects[9], &objects[10]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]);
  const Argument needed[] = {
      {"the keypoints", objects[0], 'q', count, false},
      {"the points", objects[1], 'd', 3 * count, false},
      {"the rays", objects[2], 'd', 2 * count, false},
      {"the depths", objects[3], 'd', count, false},
      {"the sigmas", objects[4], 'd', count, false},
      {"the noise of depth", objects[5], 'd', 2, false},
      {"the keypoints reversed", objects[6], 'q', count, true},
      {"the points reversed", objects[7], 'd', 3 * count, true},
      {"the rays reversed", objects[8], 'd', 2 * count, true},
      {"the depths reversed", objects[9], 'd', count, true},
      {"the sigmas reversed", objects[10], 'd', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Tracks from = {views[0].buf, views[1].buf, views[2].buf, views[3].buf, views[4].buf,
                       count};
  NewTracks to = {views[6].buf, views[7].buf, views[8].buf, views[9].buf, views[10].buf};
  Py_ssize_t found;
  Py_BEGIN_ALLOW_THREADS
  found = reverse(&from, views[5].buf, &to);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}
