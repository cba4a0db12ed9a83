// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Projection, and what the rows of a rolling shutter see.

#include <math.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"

enum { COEFFICIENTS = 12 };  // k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, as in OpenCV

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

PyObject *kernel_project(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *intrinsics_array, *distortion_array, *pixel_array;
  if (!PyArg_ParseTuple(arguments, "OOOO", &point_array, &intrinsics_array, &distortion_array,
                        &pixel_array))
    return NULL;
  const Py_ssize_t count = PyObject_Length(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the intrinsics", intrinsics_array, 'd', 4, false},
      {"the distortion", distortion_array, 'd', COEFFICIENTS, false},
      {"the pixels", pixel_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *intrinsics = arrays.views[1].buf;
  const double *distortion = arrays.views[2].buf;
  double *pixels = arrays.views[3].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i)
    project(points + 3 * i, intrinsics, distortion, pixels + 2 * i);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// Return v + w x p of a twist (v, w), without v where that is not wanted.
static void twisted(const double *v, const double *w, const double *p, double *moved) {
  moved[0] = (v ? v[0] : 0.0) + w[1] * p[2] - w[2] * p[1];
  moved[1] = (v ? v[1] : 0.0) + w[2] * p[0] - w[0] * p[2];
  moved[2] = (v ? v[2] : 0.0) + w[0] * p[1] - w[1] * p[0];
}

static void move_by_rows(const double *p, const double *constant, const double *by_row,
                         double height, double *moved) {
  double row = p[1] / (p[2] * height);
  row = row < -1.0 ? -1.0 : (row > 1.0 ? 1.0 : row);
  double twist[6], step[3], turn[3];
  for (int i = 0; i < 6; ++i)
    twist[i] = constant[i] + row * by_row[i];
  twisted(twist, twist + 3, p, step);
  twisted(NULL, twist + 3, step, turn);
  for (int i = 0; i < 3; ++i)
    moved[i] = p[i] + step[i] + 0.5 * turn[i];
}

PyObject *kernel_moved_by_rows(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *constant_array, *by_row_array, *moved_array;
  double height;
  if (!PyArg_ParseTuple(arguments, "OOOdO", &point_array, &constant_array, &by_row_array, &height,
                        &moved_array))
    return NULL;
  const Py_ssize_t count = PyObject_Length(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the twist", constant_array, 'd', 6, false},
      {"the twist by row", by_row_array, 'd', 6, false},
      {"the moved points", moved_array, 'd', 3 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *constant = arrays.views[1].buf;
  const double *by_row = arrays.views[2].buf;
  double *moved = arrays.views[3].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i)
    move_by_rows(points + 3 * i, constant, by_row, height, moved + 3 * i);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
