// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Planes fitted to the inverse depths of cells.

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>

#include "arrays.h"
#include "kernels.h"
#include "order.h"
#include "processors.h"
#include "sensor.h"

enum {
  RADIUS = 2,  // chosen: a plane is fitted to 5x5 cells
  SIDE = 2 * RADIUS + 1,
  PLACES = 256,  // chosen: interpolated at once
  SAMPLED = 13,  // chosen: numbers of which one is looked at
  AROUND = 5,    // chosen: pixels beside an invalid one that are valid, of eight, if it is no hole
};

// The mean of the inverse depths of a cell; NaN where one is invalid, or it is out of range.
static inline float mean_inverse(const float *depths, Py_ssize_t step, Py_ssize_t side,
                                 float least, float most) {
  float sum = 0.0f;
  for (Py_ssize_t row = 0; row < side; ++row)
    for (Py_ssize_t column = 0; column < side; ++column)
      sum += 1.0f / depths[row * step + column];
  const float mean = sum / (float)(side * side);
  return mean >= least && mean <= most ? mean : NAN;
}

static inline bool is_valid(float depth) { return depth > 0.0f && depth < INFINITY; }

// The number of valid pixels around one.
static int valid_around(const float *depths, Size image, Py_ssize_t row, Py_ssize_t column) {
  int valid = 0;
  for (Py_ssize_t y = row - 1; y <= row + 1; ++y)
    for (Py_ssize_t x = column - 1; x <= column + 1; ++x)
      valid += y >= 0 && y < image.height && x >= 0 && x < image.width &&
               (y != row || x != column) && is_valid(depths[y * image.width + x]);
  return valid;
}

// Whether an invalid pixel is no part of a hole: most of those around it are valid, and the others
// are no part of one either.
static bool is_alone(const float *depths, Size image, Py_ssize_t row, Py_ssize_t column) {
  if (valid_around(depths, image, row, column) < AROUND)
    return false;
  for (Py_ssize_t y = row - 1; y <= row + 1; ++y)
    for (Py_ssize_t x = column - 1; x <= column + 1; ++x)
      if (y >= 0 && y < image.height && x >= 0 && x < image.width &&
          !is_valid(depths[y * image.width + x]) &&
          valid_around(depths, image, y, x) < AROUND - 1)
        return false;
  return true;
}

// The mean inverse depth of a cell of which some pixels are invalid, each alone, by its first row
// and column: of those pixels whose mirror images about its centre are valid, too, so that it is
// exact on a plane. NaN where that is less than half of them.
static float mean_of_mirrored(const float *depths, Size image, Py_ssize_t row, Py_ssize_t column,
                              Py_ssize_t side) {
  const Py_ssize_t step = image.width, last = side - 1;
  const float *cell = depths + row * step + column;
  for (Py_ssize_t y = 0; y < side; ++y)
    for (Py_ssize_t x = 0; x < side; ++x)
      if (!is_valid(cell[y * step + x]) && !is_alone(depths, image, row + y, column + x))
        return NAN;
  int used = 0;
  float sum = 0.0f;
  for (Py_ssize_t y = 0; y < side; ++y) {
    for (Py_ssize_t x = 0; x < side; ++x) {
      const float depth = cell[y * step + x], mirrored = cell[(last - y) * step + last - x];
      if (is_valid(depth) && is_valid(mirrored)) {
        sum += 1.0f / depth;
        ++used;
      }
    }
  }
  return 2 * used >= side * side ? sum / (float)used : NAN;
}

static inline int count_valid(const float *cell, Py_ssize_t step, Py_ssize_t side) {
  int valid = 0;
  for (Py_ssize_t row = 0; row < side; ++row)
    for (Py_ssize_t column = 0; column < side; ++column)
      valid += is_valid(cell[row * step + column]);
  return valid;
}

// The means of cells that have none as some of their pixels are invalid.
FOR_EACH_PROCESSOR
static void average_rest(const float *depths, Size image, Py_ssize_t side, float least, float most,
                         Size size, float *inverse) {
  for (Py_ssize_t row = 0; row < size.height; ++row) {
    for (Py_ssize_t column = 0; column < size.width; ++column) {
      float *mean = inverse + row * size.width + column;
      if (!isnan(*mean))
        continue;
      const float *cell = depths + row * side * image.width + column * side;
      const int valid = side == 4 ? count_valid(cell, image.width, 4)
                                  : count_valid(cell, image.width, side);
      if (2 * valid < side * side || valid == side * side)
        continue;
      const float rest = mean_of_mirrored(depths, image, row * side, column * side, side);
      *mean = rest >= least && rest <= most ? rest : NAN;
    }
  }
}

FOR_EACH_PROCESSOR
static void average(const float *depths, Py_ssize_t step, Py_ssize_t side, float least, float most,
                    Size size, float *inverse) {
  for (Py_ssize_t row = 0; row < size.height; ++row) {
    const float *first = depths + row * side * step;
    float *means = inverse + row * size.width;
    if (side == 4)  // the usual one: several times as fast where the compiler knows it
      for (Py_ssize_t column = 0; column < size.width; ++column)
        means[column] = mean_inverse(first + 4 * column, step, 4, least, most);
    else
      for (Py_ssize_t column = 0; column < size.width; ++column)
        means[column] = mean_inverse(first + side * column, step, side, least, most);
  }
}

PyObject *kernel_mean_inverse_depths(PyObject *module, PyObject *arguments) {
  PyObject *depth_array, *inverse_array;
  Py_ssize_t side;
  float least, most;
  if (!PyArg_ParseTuple(arguments, "OnffO", &depth_array, &side, &least, &most, &inverse_array))
    return NULL;
  const Argument needed[] = {
      {"the depths", depth_array, 'f', IMAGE, false},
      {"the inverse depths", inverse_array, 'f', IMAGE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size image = size_of(&arrays.views[0]), size = size_of(&arrays.views[1]);
  const bool fits = side > 0 && size.height <= image.height / side &&
                    size.width <= image.width / side;
  if (fits) {
    Py_BEGIN_ALLOW_THREADS
    average(arrays.views[0].buf, image.width, side, least, most, size, arrays.views[1].buf);
    average_rest(arrays.views[0].buf, image, side, least, most, size, arrays.views[1].buf);
    Py_END_ALLOW_THREADS
  } else {
    PyErr_SetString(PyExc_ValueError, "the image has fewer cells than that");
  }
  close_arrays(&arrays);
  if (!fits)
    return NULL;
  Py_RETURN_NONE;
}

// One number where another is at least 0 and below an end, otherwise a third one.
static inline float if_below(float number, float end, float inside, float outside) {
  const float if_positive = number >= 0.0f ? inside : outside;
  return number < end ? if_positive : outside;
}

// Interpolate bilinearly between the cells around places in a grid, whose columns and rows are
// given; NaN where there are not four of them. One loop alone would not be done in lanes.
FOR_EACH_PROCESSOR
static void interpolate(const float *restrict values, Size size, const float *restrict columns,
                        const float *restrict rows, Py_ssize_t count,
                        float *restrict interpolated) {
  const float last_column = (float)((int)size.width - 1), last_row = (float)((int)size.height - 1);
  const int32_t width = (int32_t)size.width;
  const float *right = values + 1, *lower = values + width, *lower_right = lower + 1;
  float across[PLACES], down[PLACES];
  for (Py_ssize_t done = 0; done < count; done += PLACES) {
    const int places = count - done < PLACES ? (int)(count - done) : PLACES;
    const float *column = columns + done, *row = rows + done;
    float *result = interpolated + done;
    for (int i = 0; i < places; ++i) {
      across[i] = if_below(column[i], last_column, column[i], 0.0f);
      down[i] = if_below(row[i], last_row, row[i], 0.0f);
    }
    for (int i = 0; i < places; ++i) {
      const int32_t left = (int32_t)across[i], upper = (int32_t)down[i];
      const float to_right = across[i] - (float)left, downwards = down[i] - (float)upper;
      const int32_t at = upper * width + left;
      const float above = values[at] + (right[at] - values[at]) * to_right;
      const float below = lower[at] + (lower_right[at] - lower[at]) * to_right;
      result[i] = above + (below - above) * downwards;
    }
    for (int i = 0; i < places; ++i)
      result[i] = if_below(column[i], last_column, if_below(row[i], last_row, result[i], NAN),
                           NAN);
  }
}

PyObject *kernel_interpolate(PyObject *module, PyObject *arguments) {
  PyObject *value_array, *column_array, *row_array, *interpolated_array;
  if (!PyArg_ParseTuple(arguments, "OOOO", &value_array, &column_array, &row_array,
                        &interpolated_array))
    return NULL;
  const Py_ssize_t count = row_count(column_array);
  const Argument needed[] = {
      {"the values", value_array, 'f', IMAGE, false},
      {"the columns", column_array, 'f', count, false},
      {"the rows", row_array, 'f', count, false},
      {"the interpolated values", interpolated_array, 'f', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[0]);
  const bool fits = size.height > 1 && size.width > 1 && size.height <= INT32_MAX / size.width;
  if (fits) {
    Py_BEGIN_ALLOW_THREADS
    interpolate(arrays.views[0].buf, size, arrays.views[1].buf, arrays.views[2].buf, count,
                arrays.views[3].buf);
    Py_END_ALLOW_THREADS
  } else {
    PyErr_SetString(PyExc_ValueError, "the values are too few or too many to interpolate between");
  }
  close_arrays(&arrays);
  if (!fits)
    return NULL;
  Py_RETURN_NONE;
}

// What is known of the cells of a row, and of those beside it.
typedef struct {
  // of each row of a window, its number by their count: inverse depths less a level, and squares
  double *levels[SIDE], *level_squares[SIDE];
  // sums over the columns of cells about them: of those, of those times the row, of the squares
  double *values, *slopes, *squares;
  float *mean, *along_x, *along_y;  // the plane: its inverse depth, and derivatives by the cell
  float *rays;                      // x of the rays of the columns, on the plane z = 1
} Row;

enum { ROW_DOUBLES = 2 * SIDE + 3, PLANE_FLOATS = 3, ROW_FLOATS = PLANE_FLOATS + 1 };

FOR_EACH_PROCESSOR
static void take_levels(const float *restrict inverse, Py_ssize_t width, double level,
                        double *restrict levels, double *restrict squares) {
  for (Py_ssize_t x = 0; x < width; ++x) {
    levels[x] = (double)inverse[x] - level;
    squares[x] = levels[x] * levels[x];
  }
}

static inline double sum(double a, double b, double c, double d, double e) {
  return a + b + c + d + e;
}

// The sum of five numbers, times their places from the middle one.
static inline double moment(double a, double b, double d, double e) {
  return 2.0 * (e - a) + (d - b);
}

FOR_EACH_PROCESSOR
static void sum_columns(const double *restrict a, const double *restrict b,
                        const double *restrict c, const double *restrict d,
                        const double *restrict e, Py_ssize_t width, double *restrict sums) {
  for (Py_ssize_t x = 0; x < width; ++x)
    sums[x] = sum(a[x], b[x], c[x], d[x], e[x]);
}

FOR_EACH_PROCESSOR
static void find_slopes(const double *restrict a, const double *restrict b,
                        const double *restrict d, const double *restrict e, Py_ssize_t width,
                        double *restrict slopes) {
  for (Py_ssize_t x = 0; x < width; ++x)
    slopes[x] = moment(a[x], b[x], d[x], e[x]);
}

// Sum up the columns of a window from its first row on.
static void sum_window(const Row *row, Py_ssize_t first, Py_ssize_t width) {
  const double *of[SIDE], *squares[SIDE];
  for (int i = 0; i < SIDE; ++i) {
    of[i] = row->levels[(first + i) % SIDE];
    squares[i] = row->level_squares[(first + i) % SIDE];
  }
  sum_columns(of[0], of[1], of[2], of[3], of[4], width, row->values);
  find_slopes(of[0], of[1], of[3], of[4], width, row->slopes);
  sum_columns(squares[0], squares[1], squares[2], squares[3], squares[4], width, row->squares);
}

static inline double sum_about(const double *n) { return sum(n[-2], n[-1], n[0], n[1], n[2]); }

// Fit planes about the cells of a row; nothing is known of the cells at its ends.
FOR_EACH_PROCESSOR
static void fit_row(const Row *row, Py_ssize_t width, double level, float *restrict roughness) {
  const double share = 1.0 / (SIDE * SIDE);                   // of one cell
  const double by_spread = 1.0 / (SIDE * 2.0 * (1.0 + 4.0));  // of columns, or rows
  const double *restrict values = row->values, *restrict slopes = row->slopes;
  const double *restrict squares = row->squares;
  float *restrict mean = row->mean, *restrict to_right = row->along_x;
  float *restrict downwards = row->along_y;
  for (Py_ssize_t x = RADIUS; x < width - RADIUS; ++x) {
    const double *v = values + x;
    const double average = share * sum_about(v), along_x = moment(v[-2], v[-1], v[1], v[2]);
    const double along_y = sum_about(slopes + x);
    const double residual = share * sum_about(squares + x) - average * average -
                            (along_x * along_x + along_y * along_y) * (by_spread * share);
    mean[x] = (float)(average + level);
    to_right[x] = (float)(along_x * by_spread);
    downwards[x] = (float)(along_y * by_spread);
    // not the root of a negative number, which rounding may leave on a plane
    roughness[x] = (float)sqrt(0.5 * (residual + fabs(residual)));
  }
}

// The camera of the cells.
typedef struct {
  float fx, fy, cx, cy;
} CellCamera;

typedef struct {
  float *points, *normals, *roughness, *cosines;
} Planes;

// Write the planes of a row of cells from one on: (a, b, c) . p = 1 has the inverse depth
// a x + b y + c.
FOR_EACH_PROCESSOR
static void place_row(const Row *row, Py_ssize_t width, float y, const CellCamera *camera,
                      float *restrict points, float *restrict normals, float *restrict cosines) {
  const float ray_y = (y - camera->cy) / camera->fy, fx = camera->fx, fy = camera->fy;
  const float *restrict rays = row->rays;
  const float *restrict means = row->mean, *restrict to_right = row->along_x;
  const float *restrict downwards = row->along_y;
  for (Py_ssize_t x = 0; x < width; ++x) {
    const float ray_x = rays[x], mean = means[x];
    const float a = to_right[x] * fx, b = downwards[x] * fy, c = mean - a * ray_x - b * ray_y;
    const float distance = 1.0f / sqrtf(a * a + b * b + c * c), z = 1.0f / mean;
    normals[3 * x] = a * distance;
    normals[3 * x + 1] = b * distance;
    normals[3 * x + 2] = c * distance;
    points[3 * x] = ray_x * z;
    points[3 * x + 1] = ray_y * z;
    points[3 * x + 2] = z;
    cosines[x] = distance * mean / sqrtf(ray_x * ray_x + ray_y * ray_y + 1.0f);
  }
}

static void fill(float *numbers, Py_ssize_t count, float value) {
  for (Py_ssize_t i = 0; i < count; ++i)
    numbers[i] = value;
}

static void fit_planes(const float *inverse, Size size, double level, const CellCamera *camera,
                       const Row *row, const Planes *planes) {
  const Py_ssize_t width = size.width;
  for (Py_ssize_t x = 0; x < width; ++x)
    row->rays[x] = ((float)(int)x - camera->cx) / camera->fx;
  fill(planes->roughness, size.height * width, NAN);
  Py_ssize_t taken = 0;  // rows
  for (Py_ssize_t y = 0; y < size.height; ++y) {
    fill(row->mean, PLANE_FLOATS * width, NAN);
    if (y >= RADIUS && y < size.height - RADIUS) {
      for (; taken <= y + RADIUS; ++taken)
        take_levels(inverse + taken * width, width, level, row->levels[taken % SIDE],
                    row->level_squares[taken % SIDE]);
      sum_window(row, y - RADIUS, width);
      fit_row(row, width, level, planes->roughness + y * width);
    }
    place_row(row, width, (float)y, camera, planes->points + 3 * y * width,
              planes->normals + 3 * y * width, planes->cosines + y * width);
  }
}

// About the mean of the numbers, of some that are finite; 0 without any.
static double rough_mean(const float *numbers, Py_ssize_t count) {
  double sum = 0.0;
  Py_ssize_t finite = 0;
  for (Py_ssize_t i = 0; i < count; i += SAMPLED) {
    if (isfinite(numbers[i])) {
      sum += numbers[i];
      ++finite;
    }
  }
  return finite > 0 ? sum / (double)finite : 0.0;
}

// A row in memory for so many numbers for each cell.
static Row make_row(double *doubles, float *floats, Py_ssize_t width) {
  Row row = {.values = doubles, .slopes = doubles + width, .squares = doubles + 2 * width};
  for (int i = 0; i < SIDE; ++i) {
    row.levels[i] = doubles + (3 + 2 * i) * width;
    row.level_squares[i] = row.levels[i] + width;
  }
  row.mean = floats;
  row.along_x = floats + width;
  row.along_y = floats + 2 * width;
  row.rays = floats + PLANE_FLOATS * width;
  return row;
}

PyObject *kernel_fit_planes(PyObject *module, PyObject *arguments) {
  PyObject *inverse_array, *intrinsics_array, *point_array, *normal_array, *roughness_array;
  PyObject *cosine_array;
  if (!PyArg_ParseTuple(arguments, "OOOOOO", &inverse_array, &intrinsics_array, &point_array,
                        &normal_array, &roughness_array, &cosine_array))
    return NULL;
  const Py_ssize_t count = row_count(roughness_array);
  const Argument needed[] = {
      {"the inverse depths", inverse_array, 'f', IMAGE, false},
      {"the intrinsics", intrinsics_array, 'd', 4, false},
      {"the points", point_array, 'f', 3 * count, true},
      {"the normals", normal_array, 'f', 3 * count, true},
      {"the roughness", roughness_array, 'f', count, true},
      {"the cosines", cosine_array, 'f', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[0]);
  const double *intrinsics = arrays.views[1].buf;
  const CellCamera camera = {(float)intrinsics[0], (float)intrinsics[1], (float)intrinsics[2],
                             (float)intrinsics[3]};
  const Planes planes = {arrays.views[2].buf, arrays.views[3].buf, arrays.views[4].buf,
                         arrays.views[5].buf};
  const size_t width = (size_t)size.width;
  double *sums = malloc(ROW_DOUBLES * width * sizeof(*sums));
  float *fits = malloc(ROW_FLOATS * width * sizeof(*fits));
  const bool is_ready = sums != NULL && fits != NULL && size.height * size.width == count;
  if (is_ready) {
    const float *inverse = arrays.views[0].buf;
    const Row row = make_row(sums, fits, size.width);
    Py_BEGIN_ALLOW_THREADS
    // centred, because differences of large squares cancel
    fit_planes(inverse, size, rough_mean(inverse, count), &camera, &row, &planes);
    Py_END_ALLOW_THREADS
  } else if (sums == NULL || fits == NULL) {
    PyErr_NoMemory();
  } else {
    PyErr_SetString(PyExc_ValueError, "there are not as many planes as cells");
  }
  free(sums);
  free(fits);
  close_arrays(&arrays);
  if (!is_ready)
    return NULL;
  Py_RETURN_NONE;
}

// Which cells a plane fits to: smooth by the noise of the camera, and not seen at a grazing angle.
typedef struct {
  DepthNoise noise;
  double by_decile, by_quartile;  // largest roughness, as ratios to those of the smoothest cells
  double low, high;               // its bounds, in standard deviations of the noise
  float smallest_cosine;
} SmoothRule;

// Copy every second finite number of every second row; return how many there are.
static Py_ssize_t sample(const float *numbers, Size size, double *sampled) {
  Py_ssize_t count = 0;
  for (Py_ssize_t row = 0; row < size.height; row += 2) {
    for (Py_ssize_t column = 0; column < size.width; column += 2) {
      sampled[count] = numbers[row * size.width + column];
      count += isfinite(sampled[count]) != 0;
    }
  }
  return count;
}

// The largest roughness of a plane, in standard deviations of the noise; there is room for some.
static double largest_roughness(const float *relative, Size size, const SmoothRule *rule,
                                double *sampled) {
  const Py_ssize_t count = sample(relative, size, sampled);
  if (count == 0)
    return rule->high;
  const double quartile = selected(sampled, count, count / 4);
  const double decile = selected(sampled, count / 4 + 1, count / 10);  // of those not larger
  const double largest = fmin(rule->by_decile * decile, rule->by_quartile * quartile);
  return fmin(fmax(largest, rule->low), rule->high);
}

FOR_EACH_PROCESSOR
static void find_relative(const float *points, const float *roughness, Py_ssize_t count,
                          const SmoothRule *rule, float *relative) {
  const DepthNoise noise = rule->noise;
  for (Py_ssize_t i = 0; i < count; ++i)
    relative[i] = roughness[i] / (float)inverse_depth_sigma(points[3 * i + 2], noise);
}

FOR_EACH_PROCESSOR
static void mark_smooth(const float *relative, const float *cosines, Py_ssize_t count,
                        float largest, float smallest_cosine, bool *is_smooth) {
  for (Py_ssize_t i = 0; i < count; ++i)
    is_smooth[i] = (relative[i] < largest) & (cosines[i] > smallest_cosine);
}

PyObject *kernel_smooth_cells(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *roughness_array, *cosine_array, *noise_array, *smooth_array;
  SmoothRule rule;
  if (!PyArg_ParseTuple(arguments, "OOOOddddfO", &point_array, &roughness_array, &cosine_array,
                        &noise_array, &rule.by_decile, &rule.by_quartile, &rule.low, &rule.high,
                        &rule.smallest_cosine, &smooth_array))
    return NULL;
  const Py_ssize_t count = row_count(smooth_array);
  const Argument needed[] = {
      {"the points", point_array, 'f', 3 * count, false},
      {"the roughness", roughness_array, 'f', IMAGE, false},
      {"the cosines", cosine_array, 'f', count, false},
      {"the noise of depth", noise_array, 'd', 2, false},
      {"the smooth cells", smooth_array, '?', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[1]);
  rule.noise = *(const DepthNoise *)arrays.views[3].buf;
  const bool fits = size.height * size.width == count;
  double *sampled = malloc((size_t)(count + 1) * sizeof(*sampled));
  float *relative = malloc((size_t)(count + 1) * sizeof(*relative));
  const bool is_made = sampled != NULL && relative != NULL;
  if (fits && is_made) {
    Py_BEGIN_ALLOW_THREADS
    find_relative(arrays.views[0].buf, arrays.views[1].buf, count, &rule, relative);
    const double largest = largest_roughness(relative, size, &rule, sampled);
    mark_smooth(relative, arrays.views[2].buf, count, (float)largest, rule.smallest_cosine,
                arrays.views[4].buf);
    Py_END_ALLOW_THREADS
  } else if (!is_made) {
    PyErr_NoMemory();
  } else {
    PyErr_SetString(PyExc_ValueError, "there are not as many cells as their roughness");
  }
  free(sampled);
  free(relative);
  close_arrays(&arrays);
  if (!fits || !is_made)
    return NULL;
  Py_RETURN_NONE;
}
