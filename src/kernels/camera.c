// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Points and their pixels.

#include <math.h>
#include <stdbool.h>

#include "arrays.h"
#include "camera_model.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum { MOST_STEPS = 50 };  // chosen

static const double CONVERGED = 1e-9;     // px; chosen
static const double LARGEST_ERROR = 0.1;  // px; chosen: a larger one is of another ray

// The rays (x, y, 1) of up to four pixels by a rational polynomial, with OpenCV's fixed-point
// iteration; NaN where there is none.
INLINE void normalize(const double *pixels, Py_ssize_t count, const CameraModel *camera,
                      double *rays) {
  const double *focal = camera->focal, *d = camera->coefficients;
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
    distort(x, y, d, &seen_u, &seen_v);
    to_pixels(focal, &seen_u, &seen_v);
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
static void project_all(const double *points, Py_ssize_t count, const CameraModel *camera,
                        double *pixels) {
  for (Py_ssize_t i = 0; i < count; i += FOUR)
    project(points + 3 * i, count - i, camera, pixels + 2 * i);
}

FOR_EACH_PROCESSOR
static void normalize_all(const double *pixels, Py_ssize_t count, const CameraModel *camera,
                          double *rays) {
  for (Py_ssize_t i = 0; i < count; i += FOUR)
    normalize(pixels + 2 * i, count - i, camera, rays + 2 * i);
}

// A function of points or pixels, of a camera.
typedef void (*Mapping)(const double *from, Py_ssize_t count, const CameraModel *camera,
                        double *to);

// Map all rows of the first array, of a given number of coordinates, to those of the last.
static PyObject *map_rows(PyObject *arguments, Mapping mapping, const char *from_name,
                          Py_ssize_t from_size, const char *to_name) {
  PyObject *from_array, *camera_array, *to_array;
  if (!PyArg_ParseTuple(arguments, "OOO", &from_array, &camera_array, &to_array))
    return NULL;
  const Py_ssize_t count = row_count(from_array);
  const Argument needed[] = {
      {from_name, from_array, 'd', from_size * count, false},
      {"the camera", camera_array, 'd', CAMERA, false},
      {to_name, to_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const CameraModel camera = camera_of(arrays.views[1].buf);
  Py_BEGIN_ALLOW_THREADS
  mapping(arrays.views[0].buf, count, &camera, arrays.views[2].buf);
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
