// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Projection, and what the rows of a rolling shutter see.

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include "arrays.h"
#include "displacement.h"
#include "kernels.h"
#include "processors.h"

enum {
  COEFFICIENTS = 12,  // k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, as in OpenCV
  MOST_STEPS = 50,    // chosen
};

static const double CONVERGED = 1e-9;     // px; chosen
static const double LARGEST_ERROR = 0.1;  // px; chosen: a larger one is of another ray

static void project(const double *point, const double *focal, const double *d, double *pixel) {
  const double inverse = point[2] != 0.0 ? 1.0 / point[2] : 1.0;
  const double x = point[0] * inverse, y = point[1] * inverse;
  const double r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = (1.0 + d[0] * r2 + d[1] * r4 + d[4] * r6) /
                        (1.0 + d[5] * r2 + d[6] * r4 + d[7] * r6);
  const double xy = 2.0 * x * y;
  const double u = x * radial + d[2] * xy + d[3] * (r2 + 2.0 * x * x) + d[8] * r2 + d[9] * r4;
  const double v = y * radial + d[2] * (r2 + 2.0 * y * y) + d[3] * xy + d[10] * r2 + d[11] * r4;
  pixel[0] = focal[0] * u + focal[2];
  pixel[1] = focal[1] * v + focal[3];
}

// The distance of the pixel of a ray (x, y, 1) from a pixel.
static double distance_from(const double *pixel, double x, double y, const double *focal,
                            const double *d) {
  const double ray[3] = {x, y, 1.0};
  double seen[2];
  project(ray, focal, d, seen);
  const double u = seen[0] - pixel[0], v = seen[1] - pixel[1];
  return sqrt(u * u + v * v);
}

// The ray (x, y, 1) of a pixel, by OpenCV's fixed-point iteration; NaN where there is none.
static void normalize(const double *pixel, const double *focal, const double *d, double *ray) {
  const double x0 = (pixel[0] - focal[2]) / focal[0], y0 = (pixel[1] - focal[3]) / focal[1];
  double x = x0, y = y0, error = INFINITY;
  for (int step = 0; step < MOST_STEPS && !(error < CONVERGED); ++step) {
    const double r2 = x * x + y * y, r4 = r2 * r2, xy = 2.0 * x * y;
    const double inverse = (1.0 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]))) /
                           (1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4])));
    if (inverse < 0.0) {
      error = distance_from(pixel, x0, y0, focal, d);
      x = x0;
      y = y0;
      break;
    }
    const double u = d[2] * xy + d[3] * (r2 + 2.0 * x * x) + d[8] * r2 + d[9] * r4;
    const double v = d[2] * (r2 + 2.0 * y * y) + d[3] * xy + d[10] * r2 + d[11] * r4;
    x = (x0 - u) * inverse;
    y = (y0 - v) * inverse;
    error = distance_from(pixel, x, y, focal, d);
  }
  const bool is_found = error < LARGEST_ERROR;
  ray[0] = is_found ? x : NAN;
  ray[1] = is_found ? y : NAN;
}

// A function of a point or pixel, by the four intrinsics and the distortion of a camera.
typedef void (*Mapping)(const double *from, const double *focal, const double *d, double *to);

// Map all rows of the first array, of a given number of coordinates, to those of the last.
static PyObject *map_rows(PyObject *arguments, Mapping mapping, const char *from_name,
                          Py_ssize_t from_size, const char *to_name) {
  PyObject *from_array, *intrinsics_array, *distortion_array, *to_array;
  if (!PyArg_ParseTuple(arguments, "OOOO", &from_array, &intrinsics_array, &distortion_array,
                        &to_array))
    return NULL;
  const Py_ssize_t count = row_count(from_array);
  const Argument needed[] = {
      {from_name, from_array, 'd', from_size * count, false},
      {"the intrinsics", intrinsics_array, 'd', 4, false},
      {"the distortion", distortion_array, 'd', COEFFICIENTS, false},
      {to_name, to_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *from = arrays.views[0].buf, *intrinsics = arrays.views[1].buf;
  const double *distortion = arrays.views[2].buf;
  double *to = arrays.views[3].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i)
    mapping(from + from_size * i, intrinsics, distortion, to + 2 * i);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_project(PyObject *module, PyObject *arguments) {
  return map_rows(arguments, project, "the points", 3, "the pixels");
}

PyObject *kernel_normalize(PyObject *module, PyObject *arguments) {
  return map_rows(arguments, normalize, "the pixels", 2, "the rays");
}

FOR_EACH_PROCESSOR
static void move_by_rows(const Displacement *by, const double (*points)[3], Py_ssize_t count,
                         double (*moved)[3]) {
  for (Py_ssize_t first = 0; first < count; first += BATCH) {
    const int many = count - first < BATCH ? (int)(count - first) : BATCH;
    Column before[3] = {{0}}, after[3];
    for (int n = 0; n < many; ++n)
      for (int i = 0; i < 3; ++i)
        before[i][n] = points[first + n][i];
    displace(by, before, after);
    for (int n = 0; n < many; ++n)
      for (int i = 0; i < 3; ++i)
        moved[first + n][i] = after[i][n];
  }
}

PyObject *kernel_moved_by_rows(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *constant_array, *by_row_array, *moved_array;
  double height;
  if (!PyArg_ParseTuple(arguments, "OOOdO", &point_array, &constant_array, &by_row_array, &height,
                        &moved_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the twist", constant_array, 'd', 6, false},
      {"the twist by row", by_row_array, 'd', 6, false},
      {"the moved points", moved_array, 'd', 3 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Displacement displacement = {arrays.views[1].buf, arrays.views[2].buf, height};
  Py_BEGIN_ALLOW_THREADS
  move_by_rows(&displacement, arrays.views[0].buf, count, arrays.views[3].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// Move rays to points at known depths in the frame that a pose leads to, as moving its rows does.
FOR_EACH_PROCESSOR
static void move_rays(const Displacement *by, const double *pose, const double (*points)[3],
                      const double (*rays)[2], Py_ssize_t count, double (*moved)[2]) {
  for (Py_ssize_t first = 0; first < count; first += BATCH) {
    const int many = count - first < BATCH ? (int)(count - first) : BATCH;
    Column seen[3] = {{0}}, after[3];
    for (int n = 0; n < many; ++n) {
      const double *point = points[first + n], *ray = rays[first + n];
      const double depth =
          pose[8] * point[0] + pose[9] * point[1] + pose[10] * point[2] + pose[11];
      seen[0][n] = ray[0] * depth;
      seen[1][n] = ray[1] * depth;
      seen[2][n] = depth;
    }
    displace(by, seen, after);
    for (int n = 0; n < many; ++n)
      for (int i = 0; i < 2; ++i)
        moved[first + n][i] = after[i][n] / after[2][n];
  }
}

PyObject *kernel_rays_moved_by_rows(PyObject *module, PyObject *arguments) {
  PyObject *ray_array, *point_array, *pose_array, *by_row_array, *moved_array;
  double height;
  if (!PyArg_ParseTuple(arguments, "OOOOdO", &ray_array, &point_array, &pose_array,
                        &by_row_array, &height, &moved_array))
    return NULL;
  const Py_ssize_t count = row_count(ray_array);
  const Argument needed[] = {
      {"the rays", ray_array, 'd', 2 * count, false},
      {"the points", point_array, 'd', 3 * count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the twist by row", by_row_array, 'd', 6, false},
      {"the moved rays", moved_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double still[6] = {0};
  const Displacement displacement = {still, arrays.views[3].buf, height};
  Py_BEGIN_ALLOW_THREADS
  move_rays(&displacement, arrays.views[2].buf, arrays.views[1].buf, arrays.views[0].buf, count,
            arrays.views[4].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
