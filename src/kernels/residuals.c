// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Residuals of a pose with their derivatives by its error, columns (delta, theta).

#include <math.h>
#include <stdint.h>

#include "arrays.h"
#include "blocks.h"
#include "kernels.h"
#include "sensor.h"
#include "vectors.h"
#include "weights.h"

// A point rotated by a pose, 4x4, and moved by it.
static void move(const double *pose, const double *point, double *arm, double *moved) {
  for (int i = 0; i < 3; ++i) {
    arm[i] = dot(pose + 4 * i, point);
    moved[i] = arm[i] + pose[4 * i + 3];
  }
}

PyObject *kernel_reprojection(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array, *sigma_array, *pose_array;
  PyObject *value_array, *jacobian_array, *weight_array, *block_array;
  double noise;
  Robustness robustness;
  if (!PyArg_ParseTuple(arguments, "OOOOddddOOOO", &point_array, &ray_array, &sigma_array,
                        &pose_array, &noise, &robustness.width, &robustness.typical,
                        &robustness.most, &value_array, &jacobian_array, &weight_array,
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
      {"the weights", weight_array, 'd', 2 * count, true},
      {"the blocks", block_array, 'q', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *rays = arrays.views[1].buf;
  const double *sigmas = arrays.views[2].buf, *pose = arrays.views[3].buf;
  double *values = arrays.views[4].buf, *jacobian = arrays.views[5].buf;
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
    blocks[i] = blocks[count + i] = block_at(ray[0], ray[1]);
  }
  weigh_pairs(values, count, &robustness, arrays.views[6].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_track_depth(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array, *depth_array, *pose_array;
  PyObject *value_array, *jacobian_array, *weight_array, *block_array;
  double noise, exponent;
  Robustness robustness;
  if (!PyArg_ParseTuple(arguments, "OOOOdddddOOOO", &point_array, &ray_array, &depth_array,
                        &pose_array, &noise, &exponent, &robustness.width, &robustness.typical,
                        &robustness.most, &value_array, &jacobian_array, &weight_array,
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
      {"the weights", weight_array, 'd', count, true},
      {"the blocks", block_array, 'q', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *rays = arrays.views[1].buf;
  const double *depths = arrays.views[2].buf, *pose = arrays.views[3].buf;
  double *values = arrays.views[4].buf, *jacobian = arrays.views[5].buf;
  int64_t *blocks = arrays.views[7].buf;
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
    blocks[found] = block_at(rays[2 * i], rays[2 * i + 1]);
    ++found;
  }
  weigh(values, found, &robustness, arrays.views[6].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}
