// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// How a motion warps and displaces windows around points.

#include <math.h>

#include "arrays.h"
#include "kernels.h"

// The derivatives of where a point is seen after a motion by where it was, at the same depth
// [px/px], and by its inverse depth [px m].
static void derive(const double *pose, const double *point, const double *focal,
                   double jacobian[2][2], double *parallax) {
  double moved[3];  // of the point at unit depth
  for (int i = 0; i < 3; ++i)
    moved[i] = (pose[4 * i] * point[0] + pose[4 * i + 1] * point[1] + pose[4 * i + 2] * point[2] +
                pose[4 * i + 3]) / point[2];
  for (int k = 0; k < 2; ++k) {
    double by[4];  // the coordinates of the ray, its third one, and the inverse depth
    for (int i = 0; i < 4; ++i)
      by[i] = (pose[4 * k + i] - moved[k] / moved[2] * pose[8 + i]) / moved[2];
    for (int i = 0; i < 2; ++i)
      jacobian[k][i] = by[i] * focal[k] / focal[i];
    parallax[k] = by[3] * focal[k];
  }
}

// Set the identity where no number differs from it by as much as a least one.
static void neglect(double least, double warp[2][2]) {
  double largest = 0.0;
  for (int i = 0; i < 4; ++i)
    largest = fmax(largest, fabs(warp[i / 2][i % 2] - (double)(i / 2 == i % 2)));
  for (int i = 0; i < 4 && largest < least; ++i)
    warp[i / 2][i % 2] = (double)(i / 2 == i % 2);
}

PyObject *kernel_window_warps(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *pose_array, *slope_array, *warp_array;
  double focal[2], least;
  if (!PyArg_ParseTuple(arguments, "OOddOdO", &point_array, &pose_array, &focal[0], &focal[1],
                        &slope_array, &least, &warp_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the slopes", slope_array, 'd', 2 * count, false},
      {"the warps", warp_array, 'd', 4 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *pose = arrays.views[1].buf;
  const double *slopes = arrays.views[2].buf;
  double(*warps)[2][2] = arrays.views[3].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    double parallax[2];
    derive(pose, points + 3 * n, focal, warps[n], parallax);
    for (int i = 0; i < 4; ++i)
      warps[n][i / 2][i % 2] += parallax[i / 2] * slopes[2 * n + i % 2];
    neglect(least, warps[n]);
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// Solve a 2x2 system.
static void solve(const double matrix[2][2], const double *right, double *solution) {
  const double determinant = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
  solution[0] = (matrix[1][1] * right[0] - matrix[0][1] * right[1]) / determinant;
  solution[1] = (matrix[0][0] * right[1] - matrix[1][0] * right[0]) / determinant;
}

PyObject *kernel_inverted_warps(PyObject *module, PyObject *arguments) {
  PyObject *warp_array, *inverted_array;
  if (!PyArg_ParseTuple(arguments, "OO", &warp_array, &inverted_array))
    return NULL;
  const Py_ssize_t count = row_count(warp_array);
  const Argument needed[] = {
      {"the warps", warp_array, 'd', 4 * count, false},
      {"the inverted warps", inverted_array, 'd', 4 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double(*warps)[2][2] = arrays.views[0].buf;
  double(*inverted)[2][2] = arrays.views[1].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    for (int i = 0; i < 2; ++i) {
      const double unit[2] = {i == 0, i == 1};
      double column[2];
      solve(warps[n], unit, column);
      inverted[n][0][i] = column[0];
      inverted[n][1][i] = column[1];
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// How far off its centre a window is found that is stretched and whose relief is displaced, before
// it is warped.
static void shift_of(double stretch[2][2], const double *displaced, const double *moments,
                     const double *reliefs, double limit, double smallest, double *shift) {
  bool is_known = true;
  for (int i = 0; i < 4; ++i)
    is_known = is_known && fabs(stretch[i / 2][i % 2]) < limit;
  shift[0] = shift[1] = 0.0;
  if (!is_known)
    return;
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < 2; ++i) {
      shift[k] += reliefs[k + i] * displaced[i];
      for (int along = 0; along < 2; ++along)
        shift[k] += moments[3 * (1 + along) + k + i] * stretch[i][along];
    }
  const double uu = moments[0], uv = moments[1], vv = moments[2];
  const double determinant = fmax(uu * vv - uv * uv, smallest);
  const double u = (vv * shift[0] - uv * shift[1]) / determinant;
  shift[1] = (uu * shift[1] - uv * shift[0]) / determinant;
  shift[0] = u;
}

PyObject *kernel_window_shifts(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *pose_array, *warp_array, *moment_array, *relief_array, *shift_array;
  double focal[2], limit, smallest;
  if (!PyArg_ParseTuple(arguments, "OOddOOOddO", &point_array, &pose_array, &focal[0], &focal[1],
                        &warp_array, &moment_array, &relief_array, &limit, &smallest,
                        &shift_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the warps", warp_array, 'd', 4 * count, false},
      {"the moments", moment_array, 'd', 9 * count, false},
      {"the reliefs", relief_array, 'd', 3 * count, false},
      {"the shifts", shift_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *pose = arrays.views[1].buf;
  const double(*warps)[2][2] = arrays.views[2].buf;
  const double *moments = arrays.views[3].buf, *reliefs = arrays.views[4].buf;
  double *shifts = arrays.views[5].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    double moved[2][2], parallax[2], stretch[2][2], displaced[2], shift[2];
    const double(*warp)[2] = warps[n];
    derive(pose, points + 3 * n, focal, moved, parallax);
    for (int i = 0; i < 2; ++i) {
      const double column[2] = {moved[0][i], moved[1][i]};
      double solved[2];
      solve(warp, column, solved);
      for (int k = 0; k < 2; ++k)
        stretch[k][i] = solved[k] - (double)(k == i);
    }
    solve(warp, parallax, displaced);
    shift_of(stretch, displaced, moments + 9 * n, reliefs + 3 * n, limit, smallest, shift);
    for (int k = 0; k < 2; ++k)
      shifts[2 * n + k] = warp[k][0] * shift[0] + warp[k][1] * shift[1];
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
