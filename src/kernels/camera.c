// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Projection, and what the rows of a rolling shutter see.

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include "arrays.h"
#include "displacement.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum {
  COEFFICIENTS = 12,  // k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, as in OpenCV
  MOST_STEPS = 50,    // chosen
};

static const double CONVERGED = 1e-9;     // px; chosen
static const double LARGEST_ERROR = 0.1;  // px; chosen: a larger one is of another ray

// The pixels of rays (x, y, 1).
INLINE void see(Doubles x, Doubles y, const double *focal, const double *d, Doubles *u,
                Doubles *v) {
  const Doubles r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2, xy = 2.0 * x * y;
  const Doubles radial = (1.0 + d[0] * r2 + d[1] * r4 + d[4] * r6) /
                         (1.0 + d[5] * r2 + d[6] * r4 + d[7] * r6);
  *u = x * radial + d[2] * xy + d[3] * (r2 + 2.0 * x * x) + d[8] * r2 + d[9] * r4;
  *v = y * radial + d[2] * (r2 + 2.0 * y * y) + d[3] * xy + d[10] * r2 + d[11] * r4;
  *u = focal[0] * *u + focal[2];
  *v = focal[1] * *v + focal[3];
}

// The points whose coordinates are given, up to four of them.
INLINE void project(const double *points, Py_ssize_t count, const double *focal, const double *d,
                    double *pixels) {
  Doubles x, y, z, u, v;
  for (int lane = 0; lane < FOUR; ++lane) {
    const double *point = points + 3 * (lane < count ? lane : 0);
    x[lane] = point[0];
    y[lane] = point[1];
    z[lane] = point[2] != 0.0 ? point[2] : 1.0;
  }
  const Doubles inverse = 1.0 / z;
  see(x * inverse, y * inverse, focal, d, &u, &v);
  for (int lane = 0; lane < FOUR && lane < count; ++lane) {
    pixels[2 * lane] = u[lane];
    pixels[2 * lane + 1] = v[lane];
  }
}

// The rays (x, y, 1) of up to four pixels, by OpenCV's fixed-point iteration; NaN where there is
// none.
INLINE void normalize(const double *pixels, Py_ssize_t count, const double *focal, const double *d,
                      double *rays) {
  Doubles u, v, square = {0};
  for (int lane = 0; lane < FOUR; ++lane) {
    u[lane] = pixels[2 * (lane < count ? lane : 0)];
    v[lane] = pixels[2 * (lane < count ? lane : 0) + 1];
  }
  const Doubles x0 = (u - focal[2]) / focal[0], y0 = (v - focal[3]) / focal[1];
  Doubles x = x0, y = y0;
  Masks is_done = {0};
  for (int step = 0; step < MOST_STEPS && !are_all(is_done); ++step) {
    const Doubles r2 = x * x + y * y, r4 = r2 * r2, xy = 2.0 * x * y;
    const Doubles inverse = (1.0 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]))) /
                            (1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4])));
    const Doubles by_x = d[2] * xy + d[3] * (r2 + 2.0 * x * x) + d[8] * r2 + d[9] * r4;
    const Doubles by_y = d[2] * (r2 + 2.0 * y * y) + d[3] * xy + d[10] * r2 + d[11] * r4;
    const Masks is_folded = inverse < 0.0;
    x = chosen(is_done, x, chosen(is_folded, x0, (x0 - by_x) * inverse));
    y = chosen(is_done, y, chosen(is_folded, y0, (y0 - by_y) * inverse));
    Doubles seen_u, seen_v;
    see(x, y, focal, d, &seen_u, &seen_v);
    square = (seen_u - u) * (seen_u - u) + (seen_v - v) * (seen_v - v);
    is_done |= is_folded | ~(square >= CONVERGED * CONVERGED);
  }
  for (int lane = 0; lane < FOUR && lane < count; ++lane) {
    const bool is_found = square[lane] < LARGEST_ERROR * LARGEST_ERROR;
    rays[2 * lane] = is_found ? x[lane] : NAN;
    rays[2 * lane + 1] = is_found ? y[lane] : NAN;
  }
}

FOR_EACH_PROCESSOR
static void project_all(const double *points, Py_ssize_t count, const double *focal,
                        const double *d, double *pixels) {
  for (Py_ssize_t i = 0; i < count; i += FOUR)
    project(points + 3 * i, count - i, focal, d, pixels + 2 * i);
}

FOR_EACH_PROCESSOR
static void normalize_all(const double *pixels, Py_ssize_t count, const double *focal,
                          const double *d, double *rays) {
  for (Py_ssize_t i = 0; i < count; i += FOUR)
    normalize(pixels + 2 * i, count - i, focal, d, rays + 2 * i);
}

// A function of points or pixels, by the four intrinsics and the distortion of a camera.
typedef void (*Mapping)(const double *from, Py_ssize_t count, const double *focal,
                        const double *d, double *to);

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
  mapping(from, count, intrinsics, distortion, to);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_project(PyObject *module, PyObject *arguments) {
  return map_rows(arguments, project_all, "the points", 3, "the pixels");
}

PyObject *kernel_normalize(PyObject *module, PyObject *arguments) {
  return map_rows(arguments, normalize_all, "the pixels", 2, "the rays");
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
