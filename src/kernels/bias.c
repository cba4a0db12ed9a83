// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// The bias between keypoints and depth of a motion between two poses in one frame.

#include <stdbool.h>
#include <string.h>

#include "arrays.h"
#include "cholesky.h"
#include "equations.h"
#include "kernels.h"
#include "products.h"
#include "se3.h"

enum { SIZE = UNKNOWNS * UNKNOWNS, AXES = 3 };

typedef struct {
  const double *difference, *covariance, *gain;
} Bias;

typedef struct {
  double *difference, *covariance, *gain;
} NewBias;

// Fill the bias of a motion by those of its end and its start.
static void subtract(const Bias *end, const Bias *start, const double *arm, double own,
                     const double *rotation, NewBias *to) {
  double lever[UNKNOWNS][UNKNOWNS], axes[UNKNOWNS][UNKNOWNS], back[AXES * AXES];
  double covariance[SIZE] = {0.0}, difference[UNKNOWNS];
  for (int i = 0; i < AXES * AXES; ++i)
    back[i] = rotation[AXES * (i % AXES) + i / AXES];
  fill_lever(arm, lever);
  fill_axes(back, axes);
  memcpy(difference, end->difference, sizeof(difference));
  add_product(*lever, start->difference, UNKNOWNS, UNKNOWNS, 1, -1.0, difference);
  add_propagated(lever, start->covariance, covariance);
  for (int i = 0; i < SIZE; ++i)
    covariance[i] = own * (end->covariance[i] + covariance[i]);
  memset(to->difference, 0, UNKNOWNS * sizeof(double));
  memset(to->covariance, 0, SIZE * sizeof(double));
  memset(to->gain, 0, SIZE * sizeof(double));
  add_product(*axes, difference, UNKNOWNS, UNKNOWNS, 1, 1.0, to->difference);
  add_propagated(axes, covariance, to->covariance);
  add_propagated(axes, end->gain, to->gain);
}

PyObject *kernel_bias_since(PyObject *module, PyObject *arguments) {
  PyObject *objects[10];
  double own;
  if (!PyArg_ParseTuple(arguments, "OOOOOOdOOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &objects[5], &own, &objects[6], &objects[7],
                        &objects[8], &objects[9]))
    return NULL;
  const Argument needed[] = {
      {"the difference", objects[0], 'd', UNKNOWNS, false},
      {"the covariance", objects[1], 'd', SIZE, false},
      {"the gain", objects[2], 'd', SIZE, false},
      {"the difference before", objects[3], 'd', UNKNOWNS, false},
      {"the covariance before", objects[4], 'd', SIZE, false},
      {"the arm", objects[5], 'd', AXES, false},
      {"the rotation", objects[6], 'd', AXES * AXES, false},
      {"the difference of the motion", objects[7], 'd', UNKNOWNS, true},
      {"the covariance of the motion", objects[8], 'd', SIZE, true},
      {"the gain of the motion", objects[9], 'd', SIZE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Bias end = {views[0].buf, views[1].buf, views[2].buf};
  const Bias start = {views[3].buf, views[4].buf, NULL};
  NewBias to = {views[7].buf, views[8].buf, views[9].buf};
  subtract(&end, &start, views[5].buf, own, views[6].buf, &to);
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// What an increment lets expect of its bias: squares of six numbers, and shares of depth.
typedef struct {
  const double *squares;
  double of_depth;
} Expected;

// Add the covariance that a bias has in the joint pose, times a factor.
static void add_in_pose(const Expected *bias, const double *gain, double factor, double *sum) {
  double follows[2][UNKNOWNS][UNKNOWNS], covariances[2][SIZE] = {{0.0}};  // depth, the rest
  for (int i = 0; i < UNKNOWNS; ++i) {
    const double square = factor * bias->squares[i];
    covariances[0][(UNKNOWNS + 1) * i] = bias->of_depth * square;
    covariances[1][(UNKNOWNS + 1) * i] = (1.0 - bias->of_depth) * square;
    for (int k = 0; k < UNKNOWNS; ++k) {
      follows[0][i][k] = gain[UNKNOWNS * i + k];
      follows[1][i][k] = (i == k) - gain[UNKNOWNS * i + k];
    }
  }
  for (int kind = 0; kind < 2; ++kind)
    add_propagated(follows[kind], covariances[kind], sum);
}

// Numbers that a difference between keypoints and depth shows of the ratio of the bias.
typedef struct {
  double square, information, score;
} Shown;

// Invert the covariance of a difference, and find what it shows; false where it is not definite.
static bool show(const Bias *of, const Expected *bias, double ratio, double largest,
                 Shown *shown) {
  double expected[SIZE], inverse[SIZE], normalised[UNKNOWNS] = {0.0};
  memcpy(expected, of->covariance, sizeof(expected));
  for (int i = 0; i < UNKNOWNS; ++i)
    expected[(UNKNOWNS + 1) * i] += ratio * bias->squares[i];
  if (!invert(expected, UNKNOWNS, inverse))
    return false;
  add_product(inverse, of->difference, UNKNOWNS, UNKNOWNS, 1, 1.0, normalised);
  *shown = (Shown){0.0, 0.0, 0.0};
  for (int i = 0; i < UNKNOWNS; ++i)
    shown->square += of->difference[i] * normalised[i];
  const double weight = shown->square > largest ? largest / shown->square : 1.0;
  for (int i = 0; i < UNKNOWNS; ++i) {
    const double square = bias->squares[i];
    for (int k = 0; k < UNKNOWNS; ++k)
      shown->information += 0.5 * square * inverse[UNKNOWNS * i + k] *
                            inverse[UNKNOWNS * i + k] * bias->squares[k];
    shown->score += 0.5 * square *
                    (weight * normalised[i] * normalised[i] - inverse[(UNKNOWNS + 1) * i]);
  }
  return true;
}

PyObject *kernel_biased_increment(PyObject *module, PyObject *arguments) {
  PyObject *objects[6];
  double ratio, noise, usual, largest;
  Expected bias;
  if (!PyArg_ParseTuple(arguments, "OOOOdOddddO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &ratio, &objects[4], &bias.of_depth, &noise, &usual, &largest,
                        &objects[5]))
    return NULL;
  const Argument needed[] = {
      {"the difference", objects[0], 'd', UNKNOWNS, false},
      {"the covariance of the difference", objects[1], 'd', SIZE, false},
      {"the gain", objects[2], 'd', SIZE, false},
      {"the squares", objects[3], 'd', UNKNOWNS, false},
      {"the covariance", objects[4], 'd', SIZE, false},
      {"the covariance with the bias", objects[5], 'd', SIZE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Bias of = {views[0].buf, views[1].buf, views[2].buf};
  const double *covariance = views[4].buf;
  double *sum = views[5].buf;
  Shown shown;
  bias.squares = views[3].buf;
  const bool is_definite = show(&of, &bias, ratio, largest, &shown);
  if (is_definite) {
    const double factor = shown.square > usual ? shown.square / usual : 1.0;
    for (int i = 0; i < SIZE; ++i)
      sum[i] = factor * noise * covariance[i];
    add_in_pose(&bias, of.gain, factor * ratio, sum);
  }
  close_arrays(&arrays);
  if (!is_definite)
    Py_RETURN_NONE;
  return Py_BuildValue("(dd)", shown.information, shown.score);
}
