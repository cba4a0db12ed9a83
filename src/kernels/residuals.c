// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Residuals of a pose with their derivatives by its error, columns (delta, theta).

#include <math.h>
#include <stdint.h>

#include "arrays.h"
#include "displacement.h"
#include "kernels.h"
#include "vectors.h"

static const double BLOCK = 0.2;      // chosen: side of a block of the image, on the plane z = 1
static const double RAY_LIMIT = 2.0;  // chosen: rays farther out share the outer blocks
enum { BLOCKS_ACROSS = 100 };         // more than 2 RAY_LIMIT / BLOCK

static int64_t block_along(double ray) {
  const double limited = ray > -RAY_LIMIT ? (ray < RAY_LIMIT ? ray : RAY_LIMIT) : -RAY_LIMIT;
  return (int64_t)((limited + RAY_LIMIT) / BLOCK);
}

static int64_t block_of(double x, double y) {
  return BLOCKS_ACROSS * block_along(x) + block_along(y);
}

// A point rotated by a pose, 4x4, and moved by it.
static void move(const double *pose, const double *point, double *arm, double *moved) {
  for (int i = 0; i < 3; ++i) {
    arm[i] = dot(pose + 4 * i, point);
    moved[i] = arm[i] + pose[4 * i + 3];
  }
}

static double inverse_depth_sigma(double z, double sigma, double exponent) {
  return exponent == 0.0 ? sigma : sigma * pow(z, exponent);
}

PyObject *kernel_reprojection(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array, *sigma_array, *pose_array;
  PyObject *value_array, *jacobian_array, *square_array, *block_array;
  double noise;
  if (!PyArg_ParseTuple(arguments, "OOOOdOOOO", &point_array, &ray_array, &sigma_array,
                        &pose_array, &noise, &value_array, &jacobian_array, &square_array,
                        &block_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the rays", ray_array, 'd', 2 * count, false},
      {"the sigmas", sigma_array, 'd', count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the values", value_array, 'd', 2 * count, true},
      {"the jacobian", jacobian_array, 'd', 12 * count, true},
      {"the squares", square_array, 'd', count, true},
      {"the blocks", block_array, 'q', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *rays = arrays.views[1].buf;
  const double *sigmas = arrays.views[2].buf, *pose = arrays.views[3].buf;
  double *values = arrays.views[4].buf, *jacobian = arrays.views[5].buf;
  double *squares = arrays.views[6].buf;
  int64_t *blocks = arrays.views[7].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    const double *point = points + 3 * i, *ray = rays + 2 * i;
    double arm[3], moved[3];
    move(pose, point, arm, moved);
    const double inverse = 1.0 / moved[2], x = moved[0] * inverse, y = moved[1] * inverse;
    // of both coordinates: the error, and the derivatives by the moved point
    double u[4] = {x - ray[0], inverse, 0.0, -x * inverse};
    double v[4] = {y - ray[1], 0.0, inverse, -y * inverse};
    // whiten by S^(-1/2), S = noise^2 I + s s^T, s the effect of one sigma of inverse depth
    const double scale = sigmas[i] * point[2] * inverse;
    const double s = (arm[0] - arm[2] * x) * scale, t = (arm[1] - arm[2] * y) * scale;
    const double square = s * s + t * t;
    const double shrink = (1.0 - noise / sqrt(noise * noise + square)) / fmax(square, 1e-30);
    for (int k = 0; k < 4; ++k) {
      const double along = shrink * (s * u[k] + t * v[k]);
      u[k] = (u[k] - s * along) / noise;
      v[k] = (v[k] - t * along) / noise;
    }
    values[i] = u[0];
    values[count + i] = v[0];
    by_twist(u + 1, arm, jacobian + 6 * i);
    by_twist(v + 1, arm, jacobian + 6 * (count + i));
    squares[i] = u[0] * u[0] + v[0] * v[0];
    blocks[i] = blocks[count + i] = block_of(ray[0], ray[1]);
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_track_depth(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array, *depth_array, *pose_array;
  PyObject *value_array, *jacobian_array, *block_array;
  double noise, exponent;
  if (!PyArg_ParseTuple(arguments, "OOOOddOOO", &point_array, &ray_array, &depth_array,
                        &pose_array, &noise, &exponent, &value_array, &jacobian_array,
                        &block_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the rays", ray_array, 'd', 2 * count, false},
      {"the depths", depth_array, 'd', count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the values", value_array, 'd', count, true},
      {"the jacobian", jacobian_array, 'd', 6 * count, true},
      {"the blocks", block_array, 'q', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *rays = arrays.views[1].buf;
  const double *depths = arrays.views[2].buf, *pose = arrays.views[3].buf;
  double *values = arrays.views[4].buf, *jacobian = arrays.views[5].buf;
  int64_t *blocks = arrays.views[6].buf;
  Py_ssize_t found = 0;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    if (!isfinite(depths[i]))
      continue;
    double arm[3], moved[3];
    move(pose, points + 3 * i, arm, moved);
    const double z = moved[2], sigma = inverse_depth_sigma(z, noise, exponent);
    const double direction[3] = {0.0, 0.0, 1.0 / (sigma * z * z)};
    values[found] = (1.0 / depths[i] - 1.0 / z) / sigma;
    by_twist(direction, arm, jacobian + 6 * found);
    blocks[found] = block_of(rays[2 * i], rays[2 * i + 1]);
    ++found;
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}

// The surface of the target, on a grid of cells.
typedef struct {
  const float *points, *normals, *roughness;
  const char *usable;
  const double *intrinsics;  // fx fy cx cy
  Py_ssize_t width, height;
} Cells;

// Return whether a grid has such a size; false, with a ValueError, otherwise.
static bool is_size(Py_ssize_t width, Py_ssize_t height) {
  if (width >= 0 && height >= 0 && width <= LONGEST && height <= LONGEST)
    return true;
  PyErr_Format(PyExc_ValueError, "%zd x %zd is not the size of a grid", width, height);
  return false;
}

// The usable cell that a point projects to; -1 where there is none.
static Py_ssize_t cell_at(const Cells *cells, const double *point) {
  if (!(point[2] > 0.0))
    return -1;
  const double *camera = cells->intrinsics;
  const double u = rint(point[0] / point[2] * camera[0] + camera[2]);
  const double v = rint(point[1] / point[2] * camera[1] + camera[3]);
  if (!(u >= 0.0 && u < (double)cells->width && v >= 0.0 && v < (double)cells->height))
    return -1;
  const Py_ssize_t cell = (Py_ssize_t)v * cells->width + (Py_ssize_t)u;
  return cells->usable[cell] ? cell : -1;
}

static void copied(const float *vector, double *copy) {
  for (int i = 0; i < 3; ++i)
    copy[i] = vector[i];
}

PyObject *kernel_cells_at(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *usable_array, *intrinsics_array, *index_array, *cell_array;
  Cells cells = {0};
  if (!PyArg_ParseTuple(arguments, "OOnnOOO", &point_array, &usable_array, &cells.width,
                        &cells.height, &intrinsics_array, &index_array, &cell_array) ||
      !is_size(cells.width, cells.height))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the usable cells", usable_array, '?', cells.width * cells.height, false},
      {"the intrinsics", intrinsics_array, 'd', 4, false},
      {"the indices", index_array, 'q', count, true},
      {"the cells", cell_array, 'q', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf;
  cells.usable = arrays.views[1].buf;
  cells.intrinsics = arrays.views[2].buf;
  int64_t *indices = arrays.views[3].buf, *numbers = arrays.views[4].buf;
  Py_ssize_t found = 0;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    const Py_ssize_t cell = cell_at(&cells, points + 3 * i);
    if (cell >= 0) {
      indices[found] = i;
      numbers[found++] = cell;
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}

// Displace a point of a surface, to a point of the same precision.
static void displaced(const Displacement *by, const float *point, double *to) {
  double seen[3], moved[3];
  copied(point, seen);
  displace(by, seen, moved);
  for (int i = 0; i < 3; ++i)
    to[i] = (float)moved[i];
}

typedef struct {
  const double *pose;  // 4x4
  double sigma, exponent, reach, smallest_cosine;
} Pairing;

// What one pair of a point and a plane gives.
typedef struct {
  double value, jacobian[6], other[6];
} PlaneResidual;

static bool pair(const Cells *cells, const Pairing *pairing, const double *moved,
                 const double *arm, const float *source_normal, float source_roughness,
                 PlaneResidual *found) {
  const Py_ssize_t cell = cell_at(cells, moved);
  if (cell < 0)
    return false;
  double normal[3], turned[3], rotated[3], from_plane[3];
  copied(cells->normals + 3 * cell, normal);
  copied(source_normal, turned);
  for (int i = 0; i < 3; ++i) {
    rotated[i] = dot(pairing->pose + 4 * i, turned);
    from_plane[i] = moved[i] - cells->points[3 * cell + i];
  }
  const double distance = dot(from_plane, normal);
  if (!(fabs(distance) < pairing->reach) || !(dot(rotated, normal) > pairing->smallest_cosine))
    return false;
  // an error sigma of inverse depth moves a point p by sigma z p
  const double z = moved[2], target_roughness = cells->roughness[cell];
  const double relief = (target_roughness * target_roughness +
                         (double)source_roughness * source_roughness) / 2.0;
  const double noise = inverse_depth_sigma(z, pairing->sigma, pairing->exponent);
  const double root = 1.0 / (sqrt(noise * noise + relief) * z * dot(moved, normal));
  for (int i = 0; i < 3; ++i) {
    normal[i] *= root;
    rotated[i] *= root;
  }
  found->value = distance * root;
  by_twist(normal, arm, found->jacobian);
  by_twist(rotated, arm, found->other);
  return true;
}

// Add the outer product of a row to the lower triangle of a matrix.
static void add_square(const double *row, double (*sums)[6]) {
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j)
      sums[i][j] += row[i] * row[j];
}

// Multiply the lower triangle of a matrix by a factor, and copy it to the upper one.
static void complete(double factor, double (*sums)[6]) {
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) {
      sums[i][j] *= factor;
      sums[j][i] = sums[i][j];
    }
  }
}

PyObject *kernel_point_to_plane(PyObject *module, PyObject *arguments) {
  PyObject *objects[17];
  Cells cells = {0};
  Pairing pairing = {0};
  Displacement of_source = {0}, undo = {0};
  if (!PyArg_ParseTuple(arguments, "OOOOOdOOdOOOOnnOddddOOOOO", &objects[0], &objects[1],
                        &objects[2], &objects[3], &objects[4], &of_source.height, &objects[5],
                        &objects[6], &undo.height, &objects[7], &objects[8], &objects[9],
                        &objects[10], &cells.width, &cells.height, &objects[11],
                        &pairing.sigma, &pairing.exponent, &pairing.reach,
                        &pairing.smallest_cosine, &objects[12], &objects[13], &objects[14],
                        &objects[15], &objects[16]) ||
      !is_size(cells.width, cells.height))
    return NULL;
  const Py_ssize_t all = row_count(objects[0]), count = row_count(objects[1]);
  const Py_ssize_t size = cells.width * cells.height;
  const Argument needed[] = {
      {"the points of the source", objects[0], 'f', 3 * all, false},
      {"the chosen cells", objects[1], 'q', count, false},
      {"the normals of the source", objects[2], 'f', 3 * all, false},
      {"the roughness of the source", objects[3], 'f', all, false},
      {"the twists of the source", objects[4], 'd', 12, false},
      {"the pose", objects[5], 'd', 16, false},
      {"the twists of the target", objects[6], 'd', 12, false},
      {"the points of the target", objects[7], 'f', 3 * size, false},
      {"the normals of the target", objects[8], 'f', 3 * size, false},
      {"the usable cells", objects[9], '?', size, false},
      {"the roughness of the target", objects[10], 'f', size, false},
      {"the intrinsics", objects[11], 'd', 4, false},
      {"the values", objects[12], 'd', count, true},
      {"the jacobian", objects[13], 'd', 6 * count, true},
      {"the points", objects[14], 'd', 3 * count, true},
      {"the blocks", objects[15], 'q', count, true},
      {"the sums", objects[16], 'd', 72, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const float *sources = arrays.views[0].buf, *normals = arrays.views[2].buf;
  const float *roughness = arrays.views[3].buf;
  const int64_t *chosen = arrays.views[1].buf;
  of_source.constant = arrays.views[4].buf;
  of_source.by_row = of_source.constant + 6;
  pairing.pose = arrays.views[5].buf;
  undo.constant = arrays.views[6].buf;
  undo.by_row = undo.constant + 6;
  cells.points = arrays.views[7].buf;
  cells.normals = arrays.views[8].buf;
  cells.usable = arrays.views[9].buf;
  cells.roughness = arrays.views[10].buf;
  cells.intrinsics = arrays.views[11].buf;
  double *values = arrays.views[12].buf, *points = arrays.views[14].buf;
  double(*jacobian)[6] = arrays.views[13].buf;
  int64_t *blocks = arrays.views[15].buf;
  double(*information)[6] = arrays.views[16].buf, (*noise)[6] = information + 6;
  Py_ssize_t found = 0;
  bool are_cells = true;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count && are_cells; ++i) {
    const int64_t cell = chosen[i];
    are_cells = cell >= 0 && cell < all;
    if (!are_cells)
      continue;
    PlaneResidual residual;
    double before[3], arm[3], moved[3], *point = points + 3 * found;
    displaced(&of_source, sources + 3 * cell, before);
    move(pairing.pose, before, arm, moved);
    displace(&undo, moved, point);
    if (!pair(&cells, &pairing, point, arm, normals + 3 * cell, roughness[cell], &residual))
      continue;
    double difference[6];
    for (int k = 0; k < 6; ++k) {
      jacobian[found][k] = residual.jacobian[k];
      difference[k] = residual.jacobian[k] - residual.other[k];
    }
    add_square(residual.jacobian, information);
    add_square(difference, noise);
    values[found] = residual.value;
    blocks[found] = block_of(point[0] / point[2], point[1] / point[2]);
    ++found;
  }
  complete(1.0, information);
  complete(0.5, noise);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_cells) {
    PyErr_SetString(PyExc_ValueError, "a chosen cell is not one of the source");
    return NULL;
  }
  return PyLong_FromSsize_t(found);
}
