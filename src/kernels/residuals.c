// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Residuals of a pose with their derivatives by its error, columns (delta, theta).

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "arrays.h"
#include "blocks.h"
#include "cholesky.h"
#include "displacement.h"
#include "equations.h"
#include "kernels.h"
#include "processors.h"
#include "se3.h"
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

// Keypoints that a target sees.
typedef struct {
  const double (*points)[3], (*rays)[2], *sigmas, *depths;
  Py_ssize_t count;
} Tracks;

// Residuals, a row each.
typedef struct {
  double *values, (*jacobian)[6], *weights;
  int64_t *blocks;  // NULL: not asked for
} Residuals;

// Tracks side by side: points turned by the pose and moved by it, where they are seen, how far
// one standard deviation of their inverse depth moves them there, and 1 / z.
typedef struct {
  Column arms[3], places[2], spreads[2], inverses;
} Seen;

static inline void see(const Tracks *tracks, const double *pose, Py_ssize_t first, int count,
                       Seen *to) {
  Column points[3], sigmas;
  for (int n = 0; n < BATCH; ++n) {
    const Py_ssize_t track = first + (n < count ? n : 0);
    for (int i = 0; i < 3; ++i)
      points[i][n] = tracks->points[track][i];
    sigmas[n] = tracks->sigmas[track];
  }
  for (int i = 0; i < 3; ++i)
    for (int n = 0; n < BATCH; ++n)
      to->arms[i][n] = pose[4 * i] * points[0][n] + pose[4 * i + 1] * points[1][n] +
                       pose[4 * i + 2] * points[2][n];
  for (int n = 0; n < BATCH; ++n) {
    const double inverse = 1.0 / (to->arms[2][n] + pose[11]);
    const double x = (to->arms[0][n] + pose[3]) * inverse;
    const double y = (to->arms[1][n] + pose[7]) * inverse;
    const double scale = sigmas[n] * points[2][n] * inverse;
    to->inverses[n] = inverse;
    to->places[0][n] = x;
    to->places[1][n] = y;
    to->spreads[0][n] = (to->arms[0][n] - to->arms[2][n] * x) * scale;
    to->spreads[1][n] = (to->arms[1][n] - to->arms[2][n] * y) * scale;
  }
}

// Residuals of a batch of tracks, u and v, with their derivatives by the moved points: whitened by
// S^(-1/2), S = noise^2 I + s s^T, s the spread of a track.
static inline void whiten(const Seen *seen, Column *rays, double noise, Column (*rows)[4]) {
  const double precision = 1.0 / noise;
  for (int n = 0; n < BATCH; ++n) {
    const double inverse = seen->inverses[n], x = seen->places[0][n], y = seen->places[1][n];
    const double s = seen->spreads[0][n], t = seen->spreads[1][n], square = s * s + t * t;
    const double shrink = (1.0 - noise / sqrt(noise * noise + square)) /
                          (square > 1e-30 ? square : 1e-30);
    const double u[4] = {x - rays[0][n], inverse, 0.0, -x * inverse};
    const double v[4] = {y - rays[1][n], 0.0, inverse, -y * inverse};
    for (int k = 0; k < 4; ++k) {
      const double along = shrink * (s * u[k] + t * v[k]);
      rows[0][k][n] = (u[k] - s * along) * precision;
      rows[1][k][n] = (v[k] - t * along) * precision;
    }
  }
}

// Write the residuals of one coordinate of a batch with their derivatives by the pose.
static inline void write_rows(Column *rows, const Seen *seen, int count, double *values,
                              double (*jacobian)[6]) {
  for (int n = 0; n < count; ++n) {
    const double direction[3] = {rows[1][n], rows[2][n], rows[3][n]};
    const double arm[3] = {seen->arms[0][n], seen->arms[1][n], seen->arms[2][n]};
    values[n] = rows[0][n];
    by_twist(direction, arm, jacobian[n]);
  }
}

// Two residuals of a track: the first coordinates of all tracks come before the second ones.
FOR_EACH_PROCESSOR
static void reproject(const Tracks *tracks, const double *pose, double noise,
                      const Robustness *robustness, const Truncation *truncation,
                      Residuals *to) {
  const Py_ssize_t all = tracks->count;
  for (Py_ssize_t first = 0; first < all; first += BATCH) {
    const int count = all - first < BATCH ? (int)(all - first) : BATCH;
    Seen seen;
    Column rays[2] = {{0}}, rows[2][4];
    for (int n = 0; n < count; ++n) {
      const double *ray = tracks->rays[first + n];
      rays[0][n] = ray[0];
      rays[1][n] = ray[1];
      if (to->blocks != NULL)
        to->blocks[first + n] = to->blocks[all + first + n] = block_at(ray[0], ray[1]);
    }
    see(tracks, pose, first, count, &seen);
    whiten(&seen, rays, noise, rows);
    for (int i = 0; i < 2; ++i)
      write_rows(rows[i], &seen, count, to->values + i * all + first,
                 to->jacobian + i * all + first);
  }
  weigh_pairs(to->values, all, robustness, truncation, to->weights);
}

// A residual of each track that the target measures a depth of; return how many they are.
static Py_ssize_t compare_depths(const Tracks *tracks, const double *pose,
                                 const DepthNoise *noise, const Robustness *robustness,
                                 Residuals *to) {
  Py_ssize_t found = 0;
  for (Py_ssize_t i = 0; i < tracks->count; ++i) {
    if (!isfinite(tracks->depths[i]))
      continue;
    double arm[3], moved[3];
    move(pose, tracks->points[i], arm, moved);
    const double z = moved[2], sigma = inverse_depth_sigma(z, *noise);
    const double direction[3] = {0.0, 0.0, 1.0 / (sigma * z * z)};
    to->values[found] = (1.0 / tracks->depths[i] - 1.0 / z) / sigma;
    by_twist(direction, arm, to->jacobian[found]);
    if (to->blocks != NULL)
      to->blocks[found] = block_at(tracks->rays[i][0], tracks->rays[i][1]);
    ++found;
  }
  weigh(to->values, found, robustness, to->weights);
  return found;
}

PyObject *kernel_reprojection(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array, *sigma_array, *pose_array, *robustness, *truncation;
  PyObject *value_array, *jacobian_array, *weight_array, *block_array;
  double noise;
  if (!PyArg_ParseTuple(arguments, "OOOOdOOOOOO", &point_array, &ray_array, &sigma_array,
                        &pose_array, &noise, &robustness, &truncation, &value_array,
                        &jacobian_array, &weight_array, &block_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the rays", ray_array, 'd', 2 * count, false},
      {"the sigmas", sigma_array, 'd', count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the robustness", robustness, 'd', 3, false},
      {"the truncation", truncation, 'd', 2, false},
      {"the values", value_array, 'd', 2 * count, true},
      {"the jacobian", jacobian_array, 'd', 12 * count, true},
      {"the weights", weight_array, 'd', 2 * count, true},
      {"the blocks", block_array, 'q', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Tracks tracks = {views[0].buf, views[1].buf, views[2].buf, NULL, count};
  Residuals residuals = {views[6].buf, views[7].buf, views[8].buf, views[9].buf};
  Py_BEGIN_ALLOW_THREADS
  reproject(&tracks, views[3].buf, noise, views[4].buf, views[5].buf, &residuals);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_track_depth(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *ray_array, *depth_array, *pose_array, *noise, *robustness;
  PyObject *value_array, *jacobian_array, *weight_array, *block_array;
  if (!PyArg_ParseTuple(arguments, "OOOOOOOOOO", &point_array, &ray_array, &depth_array,
                        &pose_array, &noise, &robustness, &value_array, &jacobian_array,
                        &weight_array, &block_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the rays", ray_array, 'd', 2 * count, false},
      {"the depths", depth_array, 'd', count, false},
      {"the pose", pose_array, 'd', 16, false},
      {"the noise of depth", noise, 'd', 2, false},
      {"the robustness", robustness, 'd', 3, false},
      {"the values", value_array, 'd', count, true},
      {"the jacobian", jacobian_array, 'd', 6 * count, true},
      {"the weights", weight_array, 'd', count, true},
      {"the blocks", block_array, 'q', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Tracks tracks = {views[0].buf, views[1].buf, NULL, views[2].buf, count};
  Residuals residuals = {views[6].buf, views[7].buf, views[8].buf, views[9].buf};
  Py_ssize_t found;
  Py_BEGIN_ALLOW_THREADS
  found = compare_depths(&tracks, views[3].buf, views[4].buf, views[5].buf, &residuals);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}

typedef struct {
  double ray_noise, weight;
  const DepthNoise *depth_noise;
  Robustness rays, depths;
  const Truncation *truncation;
} Weighting;

// Set the normal equations of both kinds of residuals and of others, with memory for a row of a
// Jacobian, value and weight of each of two residuals of a track.
static void sum_up(const Tracks *tracks, const double *pose, const Weighting *by,
                   const double *others, const double *other_slopes, double *memory,
                   double *information, double *gradient) {
  const Py_ssize_t rows = 2 * tracks->count;
  Residuals residuals = {memory, (double(*)[6])(memory + rows), memory + 7 * rows, NULL};
  double sums[36] = {0}, slopes[6] = {0};
  reproject(tracks, pose, by->ray_noise, &by->rays, by->truncation, &residuals);
  add_equations(*residuals.jacobian, residuals.values, residuals.weights, rows, sums, slopes);
  const Py_ssize_t found = compare_depths(tracks, pose, by->depth_noise, &by->depths,
                                          &residuals);
  add_equations(*residuals.jacobian, residuals.values, residuals.weights, found, sums, slopes);
  for (int i = 0; i < 36; ++i)
    information[i] = others[i] + by->weight * sums[i];
  for (int i = 0; i < 6; ++i)
    gradient[i] = other_slopes[i] + by->weight * slopes[i];
}

// The Gauss-Newton step of normal equations, which are used up; NaN where they are not definite.
static void solve_step(double *information, const double *gradient, double *step) {
  const bool is_definite = factorize(information, UNKNOWNS);
  for (int i = 0; i < UNKNOWNS; ++i)
    step[i] = is_definite ? -gradient[i] : NAN;
  if (is_definite)
    substitute(information, UNKNOWNS, step, 1);
}

PyObject *kernel_track_steps(PyObject *module, PyObject *arguments) {
  PyObject *objects[14];
  Weighting by;
  if (!PyArg_ParseTuple(arguments, "OOOOOdOOOOOdOOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &by.ray_noise, &objects[5], &objects[6],
                        &objects[7], &objects[8], &objects[9], &by.weight, &objects[10],
                        &objects[11], &objects[12], &objects[13]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]), steps = row_count(objects[6]);
  const Argument needed[] = {
      {"the points", objects[0], 'd', 3 * count, false},
      {"the rays", objects[1], 'd', 2 * count, false},
      {"the sigmas", objects[2], 'd', count, false},
      {"the depths", objects[3], 'd', count, false},
      {"the pose", objects[4], 'd', 16, false},
      {"the noise of depth", objects[5], 'd', 2, false},
      {"the factors of the widths", objects[6], 'd', steps, false},
      {"the robustness of rays", objects[7], 'd', 3, false},
      {"the robustness of depths", objects[8], 'd', 3, false},
      {"the truncation", objects[9], 'd', 2, false},
      {"the information", objects[10], 'd', 36, false},
      {"the gradient", objects[11], 'd', 6, false},
      {"the last step", objects[12], 'd', 6, true},
      {"the result", objects[13], 'd', 16, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Tracks tracks = {views[0].buf, views[1].buf, views[2].buf, views[3].buf, count};
  by.depth_noise = views[5].buf;
  const double *wider = views[6].buf;
  const Robustness *rays = views[7].buf, *depths = views[8].buf;
  by.rays = *rays;
  by.depths = *depths;
  by.truncation = views[9].buf;
  double *step = views[12].buf, *pose = views[13].buf;
  double *memory = malloc((16 * (size_t)count + 1) * sizeof(*memory));
  if (memory != NULL) {
    Py_BEGIN_ALLOW_THREADS
    memcpy(pose, views[4].buf, 16 * sizeof(*pose));
    for (Py_ssize_t i = 0; i < steps; ++i) {
      double information[36], gradient[6];
      by.rays.width = wider[i] * rays->width;
      by.depths.width = wider[i] * depths->width;
      sum_up(&tracks, pose, &by, views[10].buf, views[11].buf, memory, information, gradient);
      solve_step(information, gradient, step);
      perturb(pose, step, pose);
    }
    Py_END_ALLOW_THREADS
  }
  close_arrays(&arrays);
  if (memory == NULL)
    return PyErr_NoMemory();
  free(memory);
  Py_RETURN_NONE;
}
