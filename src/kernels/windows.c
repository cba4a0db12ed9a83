// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// What the windows around pixels show.

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum { LARGEST_SIDE = 256 };  // of a window [px], whose sums fit into 32 bits

static Py_ssize_t limited(double value, Py_ssize_t most) {
  return value > 0.0 ? (value < (double)most ? (Py_ssize_t)value : most) : 0;
}

// The first pixel of a window around a pixel, moved into the image.
static Py_ssize_t first_of(const double *pixel, Size image, Py_ssize_t side) {
  const Py_ssize_t u = limited(rint(pixel[0]) - (double)(side / 2), image.width - side);
  const Py_ssize_t v = limited(rint(pixel[1]) - (double)(side / 2), image.height - side);
  return v * image.width + u;
}

// Whether windows with a margin around them fit into an image; else false, with a ValueError.
static bool fits(Size image, Py_ssize_t side, Py_ssize_t margin) {
  if (side >= 1 && side <= LARGEST_SIDE && side <= image.width - 2 * margin &&
      side <= image.height - 2 * margin)
    return true;
  PyErr_Format(PyExc_ValueError, "windows of %zd pixels are none, or larger than the image or %d",
               side, LARGEST_SIDE);
  return false;
}

// Products of gradients along u and v, summed over the rows of columns side by side, and the same
// times the rows: uu uv vv each.
typedef struct {
  Integers sums[3], by_row[3];
} Columns;

INLINE void add_row(Columns *columns, const uint8_t *pixel, Py_ssize_t width, int32_t row) {
  const Shorts u = load_pixels(pixel + 1) - load_pixels(pixel - 1);
  const Shorts v = load_pixels(pixel + width) - load_pixels(pixel - width);
  const Integers by_u = to_integers(u), by_v = to_integers(v);
  const Integers products[3] = {by_u * by_u, by_u * by_v, by_v * by_v};
  for (int k = 0; k < 3; ++k) {
    columns->sums[k] += products[k];
    columns->by_row[k] += products[k] * row;
  }
}

// The same of one column.
INLINE void add_pixel(int32_t (*sums)[3], const uint8_t *pixel, Py_ssize_t width, int32_t row) {
  const int32_t u = pixel[1] - pixel[-1], v = pixel[width] - pixel[-width];
  const int32_t products[3] = {u * u, u * v, v * v};
  for (int k = 0; k < 3; ++k) {
    sums[0][k] += products[k];
    sums[1][k] += products[k] * row;
  }
}

// Add what a column has to the sums, those by u, and those by v.
INLINE void add_column(int64_t (*sums)[3], int k, int64_t sum, int64_t by_row, int64_t column) {
  sums[0][k] += sum;
  sums[1][k] += sum * column;
  sums[2][k] += by_row;
}

// Sums over a window of the products of its gradients, of these by u, and by v: uu uv vv each.
INLINE void add_moments(const uint8_t *first, Py_ssize_t width, Py_ssize_t side, double *moments) {
  int64_t sums[3][3] = {{0}};
  const Py_ssize_t middle = side / 2;
  Py_ssize_t column = 0;
  for (; column + EIGHT <= side; column += EIGHT) {
    Columns columns = {{{0}}, {{0}}};
    for (Py_ssize_t row = 0; row < side; ++row)
      add_row(&columns, first + (row + 1) * width + 1 + column, width, (int32_t)(row - middle));
    for (int lane = 0; lane < EIGHT; ++lane)
      for (int k = 0; k < 3; ++k)
        add_column(sums, k, columns.sums[k][lane], columns.by_row[k][lane],
                   column + lane - middle);
  }
  for (; column < side; ++column) {
    int32_t of_column[2][3] = {{0}};
    for (Py_ssize_t row = 0; row < side; ++row)
      add_pixel(of_column, first + (row + 1) * width + 1 + column, width, (int32_t)(row - middle));
    for (int k = 0; k < 3; ++k)
      add_column(sums, k, of_column[0][k], of_column[1][k], column - middle);
  }
  for (int k = 0; k < 9; ++k)
    moments[k] = (double)sums[k / 3][k % 3];
}

FOR_EACH_PROCESSOR
static void write_moments(const uint8_t *image, Size size, const double (*pixels)[2],
                          Py_ssize_t count, Py_ssize_t side, double (*moments)[9]) {
  for (Py_ssize_t i = 0; i < count; ++i)
    add_moments(image + first_of(pixels[i], size, side + 2), size.width, side, moments[i]);
}

PyObject *kernel_gradient_moments(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *pixel_array, *moment_array;
  Py_ssize_t side;
  if (!PyArg_ParseTuple(arguments, "OOnO", &image_array, &pixel_array, &side, &moment_array))
    return NULL;
  const Py_ssize_t count = row_count(pixel_array);
  const Argument needed[] = {
      {"the image", image_array, 'B', IMAGE, false},
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the moments", moment_array, 'd', 9 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[0]);
  if (!fits(size, side, 1)) {
    close_arrays(&arrays);
    return NULL;
  }
  Py_BEGIN_ALLOW_THREADS
  write_moments(arrays.views[0].buf, size, arrays.views[1].buf, count, side, arrays.views[2].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// Sums over a window of how much nearer its pixels are than its centre, times their offsets; those
// with an invalid depth count as as far.
INLINE void add_slopes(const float *first, Py_ssize_t width, Py_ssize_t side, float inverse,
                       double *slopes) {
  const Py_ssize_t middle = side / 2;
  double along_u = 0.0, along_v = 0.0;
  Py_ssize_t column = 0;
  for (; column + EIGHT <= side; column += EIGHT) {
    Floats sums = {0}, by_row = {0};
    for (Py_ssize_t row = 0; row < side; ++row) {
      Floats nearer = 1.0f / load(first + row * width + column) - inverse;
      nearer = (Floats)((Integers)nearer & (nearer - nearer == 0.0f));
      sums += nearer;
      by_row += nearer * (float)(row - middle);
    }
    for (int lane = 0; lane < EIGHT; ++lane) {
      along_u += (double)sums[lane] * (double)(column + lane - middle);
      along_v += (double)by_row[lane];
    }
  }
  for (; column < side; ++column) {
    for (Py_ssize_t row = 0; row < side; ++row) {
      const float nearer = 1.0f / first[row * width + column] - inverse;
      const double known = nearer - nearer == 0.0f ? (double)nearer : 0.0;
      along_u += known * (double)(column - middle);
      along_v += known * (double)(row - middle);
    }
  }
  slopes[0] = along_u;
  slopes[1] = along_v;
}

FOR_EACH_PROCESSOR
static void write_slopes(const float *image, Size size, const double (*pixels)[2],
                         const double *depths, Py_ssize_t count, Py_ssize_t side,
                         double (*slopes)[2]) {
  double square = 0.0;  // of the offsets, summed over a window
  for (Py_ssize_t i = 0; i < side; ++i)
    square += (double)side * (double)(i - side / 2) * (double)(i - side / 2);
  for (Py_ssize_t i = 0; i < count; ++i) {
    add_slopes(image + first_of(pixels[i], size, side), size.width, side,
               (float)(1.0 / depths[i]), slopes[i]);
    slopes[i][0] /= square;
    slopes[i][1] /= square;
  }
}

PyObject *kernel_inverse_depth_slopes(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *pixel_array, *depth_array, *slope_array;
  Py_ssize_t side;
  if (!PyArg_ParseTuple(arguments, "OOOnO", &image_array, &pixel_array, &depth_array, &side,
                        &slope_array))
    return NULL;
  const Py_ssize_t count = row_count(pixel_array);
  const Argument needed[] = {
      {"the image", image_array, 'f', IMAGE, false},
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the depths", depth_array, 'd', count, false},
      {"the slopes", slope_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[0]);
  if (!fits(size, side, 0)) {
    close_arrays(&arrays);
    return NULL;
  }
  Py_BEGIN_ALLOW_THREADS
  write_slopes(arrays.views[0].buf, size, arrays.views[1].buf, arrays.views[2].buf, count, side,
               arrays.views[3].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

enum {
  DIRECTIONS = 8,      // each beside its opposite
  FARTHEST = 1 << 15,  // pixels from one at which edges are sought
};
static const int AROUND[DIRECTIONS][2] = {{-1, 0},  {1, 0}, {0, -1}, {0, 1},
                                          {-1, -1}, {1, 1}, {-1, 1}, {1, -1}};

typedef struct {
  double least_rise, least_step;
  Py_ssize_t reach;
} EdgeRule;

// By how much nearer a pixel is than the one in the middle, as a ratio; 0 where it is invalid.
static double rise_at(const float *image, Size size, double u, double v, const int *direction,
                      Py_ssize_t distance, double depth) {
  const Py_ssize_t column = limited(u + (double)(direction[0] * distance), size.width - 1);
  const Py_ssize_t row = limited(v + (double)(direction[1] * distance), size.height - 1);
  const double rise = depth / (double)image[row * size.width + column] - 1.0;
  return isfinite(rise) ? rise : 0.0;
}

// Whether a rise along a direction is a step: most of it lies between two neighbouring pixels.
static bool is_step(const float *image, Size size, double u, double v, const int *direction,
                    double depth, const EdgeRule *rule, double rise) {
  double before = 0.0, largest = 0.0;
  const double sign = rise > 0.0 ? 1.0 : -1.0;
  for (Py_ssize_t distance = 1; distance <= rule->reach; ++distance) {
    const double there = rise_at(image, size, u, v, direction, distance, depth);
    largest = fmax(largest, sign * (there - before));
    before = there;
  }
  return largest > rule->least_step * sign * rise;
}

// Return whether there is an edge beside a pixel, and the depth of a nearer surface or NaN.
static bool edge_beside(const float *image, Size size, const double *pixel, double depth,
                        const EdgeRule *rule, double *nearer) {
  const double u = rint(pixel[0]), v = rint(pixel[1]);
  double rises[DIRECTIONS], sum = 0.0;
  bool is_edge = false;
  int near = 0;
  for (int i = 0; i < DIRECTIONS; ++i)
    rises[i] = rise_at(image, size, u, v, AROUND[i], rule->reach, depth);
  for (int i = 0; i < DIRECTIONS; ++i) {
    const double rise = rises[i], bend = rise + rises[i ^ 1];
    const bool is_nearer = fmin(rise, bend) > rule->least_rise;
    const bool is_farther = fmax(rise, bend) < -rule->least_rise;
    if ((is_nearer || is_farther) && is_step(image, size, u, v, AROUND[i], depth, rule, rise)) {
      is_edge = true;
      if (is_nearer) {
        sum += rise;
        ++near;
      }
    }
  }
  *nearer = near ? depth / (1.0 + sum / near) : NAN;
  return is_edge;
}

PyObject *kernel_edges_beside(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *pixel_array, *depth_array, *nearer_array, *any_array;
  EdgeRule rule;
  if (!PyArg_ParseTuple(arguments, "OOOnddOO", &image_array, &pixel_array, &depth_array,
                        &rule.reach, &rule.least_rise, &rule.least_step, &nearer_array,
                        &any_array))
    return NULL;
  const Py_ssize_t count = row_count(pixel_array);
  const Argument needed[] = {
      {"the image", image_array, 'f', IMAGE, false},
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the depths", depth_array, 'd', count, false},
      {"the nearer depths", nearer_array, 'd', count, true},
      {"the edges", any_array, '?', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[0]);
  if (rule.reach < 0 || rule.reach > FARTHEST) {
    close_arrays(&arrays);
    PyErr_Format(PyExc_ValueError, "a reach of %zd pixels: 0 to %d are required", rule.reach,
                 FARTHEST);
    return NULL;
  }
  const float *image = arrays.views[0].buf;
  const double *pixels = arrays.views[1].buf, *depths = arrays.views[2].buf;
  double *nearer = arrays.views[3].buf;
  bool *any = arrays.views[4].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i)
    any[i] = edge_beside(image, size, pixels + 2 * i, depths[i], &rule, nearer + i);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_plane_jacobians(PyObject *module, PyObject *arguments) {
  PyObject *normal_array, *point_array, *pose_array, *jacobian_array;
  double ratio;  // of the focal lengths, fx / fy
  if (!PyArg_ParseTuple(arguments, "OOOdO", &normal_array, &point_array, &pose_array, &ratio,
                        &jacobian_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the normals", normal_array, 'd', 3 * count, false},
      {"the points", point_array, 'd', 3 * count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the jacobians", jacobian_array, 'd', 4 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *normals = arrays.views[0].buf, *points = arrays.views[1].buf;
  const double *pose = arrays.views[2].buf;
  double(*jacobians)[2][2] = arrays.views[3].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    const double *point = points + 3 * n, *normal = normals + 3 * n;
    double moved[3];  // of the point at unit depth
    for (int i = 0; i < 3; ++i)
      moved[i] = (pose[4 * i] * point[0] + pose[4 * i + 1] * point[1] +
                  pose[4 * i + 2] * point[2] + pose[4 * i + 3]) / point[2];
    for (int i = 0; i < 2; ++i) {  // by the coordinates of the ray
      double by[3];
      for (int k = 0; k < 3; ++k)
        by[k] = pose[4 * k + i] + normal[i] * pose[4 * k + 3];
      for (int k = 0; k < 2; ++k)
        jacobians[n][k][i] = (by[k] - moved[k] / moved[2] * by[2]) / moved[2];
    }
    jacobians[n][0][1] *= ratio;
    jacobians[n][1][0] /= ratio;
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

PyObject *kernel_inverted_turns(PyObject *module, PyObject *arguments) {
  PyObject *turn_array, *inverted_array;
  if (!PyArg_ParseTuple(arguments, "OO", &turn_array, &inverted_array))
    return NULL;
  const Py_ssize_t count = row_count(turn_array);
  const Argument needed[] = {
      {"the turns", turn_array, 'd', 4 * count, false},
      {"the inverted turns", inverted_array, 'd', 4 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double(*turns)[2][2] = arrays.views[0].buf;
  double(*inverted)[2][2] = arrays.views[1].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    for (int i = 0; i < 2; ++i) {
      const double unit[2] = {i == 0, i == 1};
      double column[2];
      solve(turns[n], unit, column);
      inverted[n][0][i] = column[0];
      inverted[n][1][i] = column[1];
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// How far off its centre a window is found that is stretched, before it is turned.
static void shift_of(double stretch[2][2], const double *moments, double limit, double smallest,
                     double *shift) {
  bool is_known = true;
  for (int i = 0; i < 4; ++i)
    is_known = is_known && fabs(stretch[i / 2][i % 2]) < limit;
  shift[0] = shift[1] = 0.0;
  if (!is_known)
    return;
  for (int k = 0; k < 2; ++k)
    for (int along = 0; along < 2; ++along)
      for (int i = 0; i < 2; ++i)
        shift[k] += moments[3 * (1 + along) + k + i] * stretch[i][along];
  const double uu = moments[0], uv = moments[1], vv = moments[2];
  const double determinant = fmax(uu * vv - uv * uv, smallest);
  const double u = (vv * shift[0] - uv * shift[1]) / determinant;
  shift[1] = (uu * shift[1] - uv * shift[0]) / determinant;
  shift[0] = u;
}

PyObject *kernel_window_shifts(PyObject *module, PyObject *arguments) {
  PyObject *moved_array, *turn_array, *moment_array, *shift_array;
  double limit, smallest;
  if (!PyArg_ParseTuple(arguments, "OOOddO", &moved_array, &turn_array, &moment_array, &limit,
                        &smallest, &shift_array))
    return NULL;
  const Py_ssize_t count = row_count(moved_array);
  const Argument needed[] = {
      {"the jacobians", moved_array, 'd', 4 * count, false},
      {"the jacobians of the turn", turn_array, 'd', 4 * count, false},
      {"the moments", moment_array, 'd', 9 * count, false},
      {"the shifts", shift_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  double(*moved)[2][2] = arrays.views[0].buf, (*turns)[2][2] = arrays.views[1].buf;
  const double *moments = arrays.views[2].buf;
  double *shifts = arrays.views[3].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    double stretch[2][2], shift[2];
    for (int i = 0; i < 2; ++i) {
      const double column[2] = {moved[n][0][i], moved[n][1][i]};
      double solved[2];
      solve(turns[n], column, solved);
      for (int k = 0; k < 2; ++k)
        stretch[k][i] = solved[k] - (double)(k == i);
    }
    shift_of(stretch, moments + 9 * n, limit, smallest, shift);
    for (int k = 0; k < 2; ++k)
      shifts[2 * n + k] = turns[n][k][0] * shift[0] + turns[n][k][1] * shift[1];
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
