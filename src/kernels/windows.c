// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// What the windows around pixels show.

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "arrays.h"
#include "fetch.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"
#include "sensor.h"

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
  for (Py_ssize_t i = 0; i < count; ++i) {
    if (i + 1 < count)
      fetch_rows(image + first_of(pixels[i + 1], size, side + 2), side + 2, side + 2, size.width);
    add_moments(image + first_of(pixels[i], size, side + 2), size.width, side, moments[i]);
  }
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

// Rows of a window with one pixel around it, by how much nearer than its centre they are [1/m].
enum { LONGEST_ROW = LARGEST_SIDE + 2 };
static const float UNKNOWN = -1e30f;  // as far as can be

typedef struct {
  float rows[3][LONGEST_ROW];  // the last three, in turn
} Relief;

// What counts of a relief: from which step on [1/m] an edge is that of the nearer surface, and how
// much nearer or farther the surface in the centre is at most; and the weight of slopes of zero.
typedef struct {
  float step, most;
  double ridge;
} ReliefRule;

INLINE void fill_row(const float *depths, Py_ssize_t count, float inverse, float *nearer) {
  for (Py_ssize_t i = 0; i < count; ++i) {
    const float found = 1.0f / depths[i] - inverse;
    nearer[i] = found - found == 0.0f ? found : UNKNOWN;
  }
}

INLINE float larger(float one, float other) { return one > other ? one : other; }

// How much nearer the surfaces are that the gradients of a row are on, each of which is between
// the pixels around one: 0 where that is unknown; and 0 where they are far in front or behind.
INLINE void find_owners(const float *above, const float *middle, const float *below,
                        Py_ssize_t side, const ReliefRule *rule, float *owners, float *near_ones) {
  for (Py_ssize_t i = 0; i < side; ++i) {
    const float own = middle[i + 1];
    const float near = larger(larger(middle[i], middle[i + 2]),
                              larger(above[i + 1], below[i + 1]));
    const float owner = near - own > rule->step ? near : own;
    owners[i] = owner > UNKNOWN ? owner : 0.0f;
    near_ones[i] = fabsf(owner) < rule->most ? owner : 0.0f;
  }
}

// Sums over the rows of a window for each of its columns, of the pixels on the surface in its
// centre: their number, rows, squares of rows, how much nearer they are, and that times rows.
enum { ONES, ROWS, SQUARES, NEARER, BY_ROW, SURFACE_SUMS };
typedef float SurfaceSums[SURFACE_SUMS][LARGEST_SIDE];

INLINE void add_surface_row(const float *nearer, Py_ssize_t side, float row, float most,
                            SurfaceSums sums) {
  for (Py_ssize_t i = 0; i < side; ++i) {
    const float is_on = fabsf(nearer[i]) < most ? 1.0f : 0.0f;
    const float own = fabsf(nearer[i]) < most ? nearer[i] : 0.0f;
    sums[ONES][i] += is_on;
    sums[ROWS][i] += is_on * row;
    sums[SQUARES][i] += is_on * row * row;
    sums[NEARER][i] += own;
    sums[BY_ROW][i] += own * row;
  }
}

// The slopes along u and v of the plane that fits the sums of a window best.
static void fit_plane(SurfaceSums sums, Py_ssize_t side, double ridge, double *slopes) {
  double count = 0.0, u = 0.0, v = 0.0, uu = ridge, uv = 0.0, vv = ridge;
  double nearer = 0.0, by_u = 0.0, by_v = 0.0;
  for (Py_ssize_t i = 0; i < side; ++i) {
    const double column = (double)(i - side / 2);
    count += sums[ONES][i];
    u += column * sums[ONES][i];
    v += sums[ROWS][i];
    uu += column * column * sums[ONES][i];
    uv += column * sums[ROWS][i];
    vv += sums[SQUARES][i];
    nearer += sums[NEARER][i];
    by_u += column * sums[NEARER][i];
    by_v += sums[BY_ROW][i];
  }
  slopes[0] = slopes[1] = 0.0;
  if (count == 0.0)
    return;
  uu -= u * u / count;
  uv -= u * v / count;
  vv -= v * v / count;
  by_u -= u * nearer / count;
  by_v -= v * nearer / count;
  const double determinant = uu * vv - uv * uv;
  slopes[0] = (vv * by_u - uv * by_v) / determinant;
  slopes[1] = (uu * by_v - uv * by_u) / determinant;
}

// Sums over a window of the products of its gradients, uu uv vv, times how much nearer all
// surfaces are, and those near the one in the centre; and the slopes of that one.
typedef struct {
  double *all, *near, *slopes;
} Reliefs;

INLINE void measure_reliefs(const uint8_t *first, Py_ssize_t width, const float *depths,
                            Py_ssize_t depth_width, Py_ssize_t side, float inverse,
                            const ReliefRule *rule, const Reliefs *to) {
  Relief relief;
  SurfaceSums surface;
  float owners[LARGEST_SIDE], near_ones[LARGEST_SIDE];
  Floats all[3] = {{0}}, near[3] = {{0}};
  for (int k = 0; k < 3; ++k)
    to->all[k] = to->near[k] = 0.0;
  for (int k = 0; k < SURFACE_SUMS; ++k)
    memset(surface[k], 0, (size_t)side * sizeof(float));
  for (int row = 0; row < 2; ++row)
    fill_row(depths + row * depth_width, side + 2, inverse, relief.rows[row]);
  for (Py_ssize_t row = 0; row < side; ++row) {
    fill_row(depths + (row + 2) * depth_width, side + 2, inverse, relief.rows[(row + 2) % 3]);
    const float *middle = relief.rows[(row + 1) % 3];
    find_owners(relief.rows[row % 3], middle, relief.rows[(row + 2) % 3], side, rule, owners,
                near_ones);
    add_surface_row(middle + 1, side, (float)(row - side / 2), rule->most, surface);
    const uint8_t *pixels = first + (row + 1) * width + 1;
    Py_ssize_t column = 0;
    for (; column + EIGHT <= side; column += EIGHT) {
      Columns columns = {{{0}}, {{0}}};
      add_row(&columns, pixels + column, width, 0);
      for (int k = 0; k < 3; ++k) {
        const Floats products = to_floats(columns.sums[k]);
        all[k] += products * load(owners + column);
        near[k] += products * load(near_ones + column);
      }
    }
    for (; column < side; ++column) {
      int32_t of_column[2][3] = {{0}};
      add_pixel(of_column, pixels + column, width, 0);
      for (int k = 0; k < 3; ++k) {
        to->all[k] += (double)of_column[0][k] * (double)owners[column];
        to->near[k] += (double)of_column[0][k] * (double)near_ones[column];
      }
    }
  }
  for (int lane = 0; lane < EIGHT; ++lane)
    for (int k = 0; k < 3; ++k) {
      to->all[k] += (double)all[k][lane];
      to->near[k] += (double)near[k][lane];
    }
  fit_plane(surface, side, rule->ridge, to->slopes);
}

// The rule at any depth: the largest relief is a share of the inverse depth.
typedef struct {
  DepthNoise step;
  double most, ridge;
} Steps;

FOR_EACH_PROCESSOR
static void write_reliefs(const uint8_t *image, Size size, const float *depth_image,
                          Size depth_size, const double (*pixels)[2], const double *depths,
                          Py_ssize_t count, Py_ssize_t side, const Steps *steps, double (*all)[3],
                          double (*near)[3], double (*slopes)[2]) {
  const Py_ssize_t whole = side + 2, depth_bytes = (Py_ssize_t)sizeof(*depth_image);
  for (Py_ssize_t i = 0; i < count; ++i) {
    if (i + 1 < count) {
      fetch_rows(image + first_of(pixels[i + 1], size, whole), whole, whole, size.width);
      fetch_rows(depth_image + first_of(pixels[i + 1], depth_size, whole), whole,
                 whole * depth_bytes, depth_size.width * depth_bytes);
    }
    const double inverse = 1.0 / depths[i];
    const ReliefRule rule = {
        (float)inverse_depth_sigma(depths[i], steps->step), (float)(steps->most * inverse),
        steps->ridge};
    const Reliefs reliefs = {all[i], near[i], slopes[i]};
    measure_reliefs(image + first_of(pixels[i], size, whole), size.width,
                    depth_image + first_of(pixels[i], depth_size, whole), depth_size.width, side,
                    (float)inverse, &rule, &reliefs);
  }
}

PyObject *kernel_window_reliefs(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *depth_array, *pixel_array, *centre_array;
  PyObject *step_array, *all_array, *near_array, *slope_array;
  Py_ssize_t side;
  Steps steps;
  if (!PyArg_ParseTuple(arguments, "OOOOnOddOOO", &image_array, &depth_array, &pixel_array,
                        &centre_array, &side, &step_array, &steps.most, &steps.ridge, &all_array,
                        &near_array, &slope_array))
    return NULL;
  const Py_ssize_t count = row_count(pixel_array);
  const Argument needed[] = {
      {"the image", image_array, 'B', IMAGE, false},
      {"the depth image", depth_array, 'f', IMAGE, false},
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the depths", centre_array, 'd', count, false},
      {"the step", step_array, 'd', 2, false},
      {"the reliefs of all surfaces", all_array, 'd', 3 * count, true},
      {"the reliefs", near_array, 'd', 3 * count, true},
      {"the slopes", slope_array, 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Size size = size_of(&views[0]), depth_size = size_of(&views[1]);
  if (!fits(size, side, 1) || !fits(depth_size, side, 1)) {
    close_arrays(&arrays);
    return NULL;
  }
  steps.step = *(const DepthNoise *)views[4].buf;
  Py_BEGIN_ALLOW_THREADS
  write_reliefs(views[0].buf, size, views[1].buf, depth_size, views[2].buf, views[3].buf, count,
                side, &steps, views[5].buf, views[6].buf, views[7].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

enum {
  DIRECTIONS = 8,      // each beside its opposite
  FARTHEST = 1 << 15,  // pixels from one at which edges are sought
  AHEAD = 4,           // chosen: pixels whose surroundings are on their way
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
  for (Py_ssize_t distance = 1; distance <= rule->reach; ++distance) {
    const double there = rise_at(image, size, u, v, direction, distance, depth);
    largest = fmax(largest, there - before);
    before = there;
  }
  return largest > rule->least_step * rise;
}

// Fetch the pixels that are around one at the farthest.
static void fetch_around(const float *image, Size size, const double *pixel, Py_ssize_t reach) {
  for (int i = -1; i <= 1; ++i) {
    const Py_ssize_t row = limited(rint(pixel[1]) + (double)(i * reach), size.height - 1);
    for (int k = -1; k <= 1; ++k)
      __builtin_prefetch(image + row * size.width +
                         limited(rint(pixel[0]) + (double)(k * reach), size.width - 1));
  }
}

// The depth of a nearer surface that ends beside a pixel; NaN where there is none.
static double nearer_beside(const float *image, Size size, const double *pixel, double depth,
                            const EdgeRule *rule) {
  const double u = rint(pixel[0]), v = rint(pixel[1]);
  double rises[DIRECTIONS], sum = 0.0;
  int near = 0;
  for (int i = 0; i < DIRECTIONS; ++i)
    rises[i] = rise_at(image, size, u, v, AROUND[i], rule->reach, depth);
  for (int i = 0; i < DIRECTIONS; ++i) {
    const double rise = rises[i], bend = rise + rises[i ^ 1];
    if (fmin(rise, bend) > rule->least_rise &&
        is_step(image, size, u, v, AROUND[i], depth, rule, rise)) {
      sum += rise;
      ++near;
    }
  }
  return near ? depth / (1.0 + sum / near) : NAN;
}

PyObject *kernel_nearer_beside(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *pixel_array, *depth_array, *nearer_array;
  EdgeRule rule;
  if (!PyArg_ParseTuple(arguments, "OOOnddO", &image_array, &pixel_array, &depth_array,
                        &rule.reach, &rule.least_rise, &rule.least_step, &nearer_array))
    return NULL;
  const Py_ssize_t count = row_count(pixel_array);
  const Argument needed[] = {
      {"the image", image_array, 'f', IMAGE, false},
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the depths", depth_array, 'd', count, false},
      {"the nearer depths", nearer_array, 'd', count, true},
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
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    if (i + AHEAD < count)
      fetch_around(image, size, pixels + 2 * (i + AHEAD), rule.reach);
    nearer[i] = nearer_beside(image, size, pixels + 2 * i, depths[i], &rule);
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
