// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Rigid fit to matched points, by their moments.

#include <math.h>
#include <stdint.h>

#include "arrays.h"
#include "kernels.h"
#include "vectors.h"

// Add the products of matched points (x, y, z, 1), 4x4; return false where a row is not a point.
static bool add_products(const float *source, Py_ssize_t source_count, const float *target,
                         Py_ssize_t target_count, const int64_t *matches, Py_ssize_t count,
                         double *moments) {
  for (Py_ssize_t k = 0; k < count; ++k) {
    const int64_t i = matches[2 * k], j = matches[2 * k + 1];
    if (i < 0 || i >= source_count || j < 0 || j >= target_count)
      return false;
    const float *a = source + 3 * i, *b = target + 3 * j;
    const double left[4] = {a[0], a[1], a[2], 1.0}, right[4] = {b[0], b[1], b[2], 1.0};
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column)
        moments[4 * row + column] += left[row] * right[column];
  }
  return true;
}

PyObject *kernel_moments(PyObject *module, PyObject *arguments) {
  PyObject *source_array, *target_array, *match_array, *moment_array;
  if (!PyArg_ParseTuple(arguments, "OOOO", &source_array, &target_array, &match_array,
                        &moment_array))
    return NULL;
  const Py_ssize_t source_count = row_count(source_array);
  const Py_ssize_t target_count = row_count(target_array);
  const Py_ssize_t count = row_count(match_array);
  const Argument needed[] = {
      {"the source", source_array, 'f', 3 * source_count, false},
      {"the target", target_array, 'f', 3 * target_count, false},
      {"the matches", match_array, 'q', 2 * count, false},
      {"the moments", moment_array, 'd', 16, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const float *source = arrays.views[0].buf, *target = arrays.views[1].buf;
  const int64_t *matches = arrays.views[2].buf;
  double *moments = arrays.views[3].buf;
  bool are_rows;
  Py_BEGIN_ALLOW_THREADS
  are_rows = add_products(source, source_count, target, target_count, matches, count, moments);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_rows) {
    PyErr_SetString(PyExc_ValueError, "a row of a match is not one of the points");
    return NULL;
  }
  Py_RETURN_NONE;
}

enum { MOST_SWEEPS = 30 };               // chosen: three or four suffice
static const double ORTHOGONAL = 1e-16;  // chosen: cosine of two columns

// Turn two vectors in their plane.
static void turn(double *one, double *other, double cosine, double sine) {
  for (int i = 0; i < 3; ++i) {
    const double before = one[i];
    one[i] = cosine * before - sine * other[i];
    other[i] = sine * before + cosine * other[i];
  }
}

// Make the columns of a matrix orthogonal by a rotation from the right (Hestenes 1958), which is
// added to the columns of another.
static void orthogonalize(double (*columns)[3], double (*rotation)[3]) {
  bool is_done = false;
  for (int sweep = 0; sweep < MOST_SWEEPS && !is_done; ++sweep) {
    is_done = true;
    for (int p = 0; p < 2; ++p) {
      for (int q = p + 1; q < 3; ++q) {
        const double a = dot(columns[p], columns[p]), b = dot(columns[q], columns[q]);
        const double product = dot(columns[p], columns[q]);
        if (!(fabs(product) > ORTHOGONAL * sqrt(a * b)))
          continue;
        const double ratio = (b - a) / (2.0 * product);
        const double tangent = copysign(1.0, ratio) / (fabs(ratio) + sqrt(1.0 + ratio * ratio));
        const double cosine = 1.0 / sqrt(1.0 + tangent * tangent);
        turn(columns[p], columns[q], cosine, cosine * tangent);
        turn(rotation[p], rotation[q], cosine, cosine * tangent);
        is_done = false;
      }
    }
  }
}

static void cross(const double *a, const double *b, double *product) {
  for (int i = 0; i < 3; ++i)
    product[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

// The rotation that brings the source of a matrix of centred products to the target, without
// reflection; return false where the second singular value is too small.
static bool fit_rotation(double (*products)[3], double collinear, double rounding,
                         double (*rotation)[3]) {
  double columns[3][3], right[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, lengths[3];
  for (int i = 0; i < 9; ++i)
    columns[i % 3][i / 3] = products[i / 3][i % 3];
  orthogonalize(columns, right);
  int first = 0, last = 0;
  for (int i = 0; i < 3; ++i) {
    lengths[i] = sqrt(dot(columns[i], columns[i]));
    first = lengths[i] > lengths[first] ? i : first;
    last = lengths[i] <= lengths[last] ? i : last;
  }
  const int second = 3 - first - last;
  if (first == last || !(lengths[second] > collinear * lengths[first] + rounding))
    return false;
  double u[3][3], v[3][3];
  for (int i = 0; i < 3; ++i) {
    u[0][i] = columns[first][i] / lengths[first];
    u[1][i] = columns[second][i] / lengths[second];
    v[0][i] = right[first][i];
    v[1][i] = right[second][i];
  }
  cross(u[0], u[1], u[2]);
  cross(v[0], v[1], v[2]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      rotation[i][j] = v[0][i] * u[0][j] + v[1][i] * u[1][j] + v[2][i] * u[2][j];
  return true;
}

// The pose by moments of at least one pair of points; false where they do not determine it.
static bool fit_moments(double (*moments)[4], double collinear, double rounding,
                        double (*pose)[4]) {
  const double count = moments[3][3];
  double products[3][3], rotation[3][3], squares = 0.0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      products[i][j] = moments[i][j] - moments[i][3] * (moments[3][j] / count);
  for (int i = 0; i < 16; ++i)
    squares += moments[i / 4][i % 4] * moments[i / 4][i % 4];
  if (!fit_rotation(products, collinear, rounding * sqrt(squares), rotation))
    return false;
  for (int i = 0; i < 3; ++i) {
    pose[i][3] = moments[3][i] / count;
    for (int j = 0; j < 3; ++j) {
      pose[i][j] = rotation[i][j];
      pose[i][3] -= rotation[i][j] * (moments[j][3] / count);
      pose[3][j] = 0.0;
    }
  }
  pose[3][3] = 1.0;
  return true;
}

PyObject *kernel_fit_moments(PyObject *module, PyObject *arguments) {
  PyObject *moment_array, *pose_array;
  double collinear, rounding;
  if (!PyArg_ParseTuple(arguments, "OddO", &moment_array, &collinear, &rounding, &pose_array))
    return NULL;
  const Argument needed[] = {
      {"the moments", moment_array, 'd', 16, false},
      {"the pose", pose_array, 'd', 16, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const bool is_fit =
      fit_moments(arrays.views[0].buf, collinear, rounding, arrays.views[1].buf);
  close_arrays(&arrays);
  return PyBool_FromLong(is_fit);
}
