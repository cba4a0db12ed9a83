// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// The bias between keypoints and depth of a motion between two poses in one frame.

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "arrays.h"
#include "cholesky.h"
#include "equations.h"
#include "kernels.h"
#include "products.h"

enum { SIZE = UNKNOWNS * UNKNOWNS, AXES = 3 };

// Write the transpose of a matrix of six rows and columns.
static void transpose(const double *matrix, double *transposed) {
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int k = 0; k < UNKNOWNS; ++k)
      transposed[UNKNOWNS * k + i] = matrix[UNKNOWNS * i + k];
}

// Write a matrix as a change of the axes expresses it, all 6x6: change, matrix, its transpose.
static void express(const double *change, const double *matrix, double *expressed) {
  double half[SIZE] = {0.0}, back[SIZE];
  transpose(change, back);
  add_product(change, matrix, UNKNOWNS, UNKNOWNS, UNKNOWNS, 1.0, half);
  memset(expressed, 0, SIZE * sizeof(*expressed));
  add_product(half, back, UNKNOWNS, UNKNOWNS, UNKNOWNS, 1.0, expressed);
}

// The matrix that moves an error to a point displaced by an arm.
static void move_to(const double *arm, double *moved) {
  memset(moved, 0, SIZE * sizeof(*moved));
  for (int i = 0; i < UNKNOWNS; ++i)
    moved[(UNKNOWNS + 1) * i] = 1.0;
  for (int i = 0; i < AXES; ++i) {
    const int next = (i + 1) % AXES, last = (i + 2) % AXES;
    moved[UNKNOWNS * i + AXES + next] = arm[last];
    moved[UNKNOWNS * i + AXES + last] = -arm[next];
  }
}

// The matrix that expresses an error in the axes of a rotated frame.
static void turn_into(const double *rotation, double *turned) {
  memset(turned, 0, SIZE * sizeof(*turned));
  for (int i = 0; i < AXES; ++i)
    for (int k = 0; k < AXES; ++k)
      turned[UNKNOWNS * i + k] = turned[UNKNOWNS * (AXES + i) + AXES + k] = rotation[AXES * k + i];
}

typedef struct {
  const double *difference, *covariance, *gain;
} Bias;

typedef struct {
  double *difference, *covariance, *gain;
} NewBias;

// Fill the bias of a motion by those of its end and its start.
static void subtract(const Bias *end, const Bias *start, const double *arm, double own,
                     const double *rotation, NewBias *to) {
  double moved[SIZE], turned[SIZE], covariance[SIZE], difference[UNKNOWNS];
  move_to(arm, moved);
  turn_into(rotation, turned);
  memcpy(difference, end->difference, sizeof(difference));
  add_product(moved, start->difference, UNKNOWNS, UNKNOWNS, 1, -1.0, difference);
  memset(to->difference, 0, sizeof(difference));
  add_product(turned, difference, UNKNOWNS, UNKNOWNS, 1, 1.0, to->difference);
  express(moved, start->covariance, covariance);
  for (int i = 0; i < SIZE; ++i)
    covariance[i] = own * (end->covariance[i] + covariance[i]);
  express(turned, covariance, to->covariance);
  express(turned, end->gain, to->gain);
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
  double scaled[SIZE], rest[SIZE], transposed[SIZE];
  for (int part = 0; part < 2; ++part) {
    for (int i = 0; i < UNKNOWNS; ++i) {
      for (int k = 0; k < UNKNOWNS; ++k) {
        const int at = UNKNOWNS * i + k;
        rest[at] = part ? (i == k) - gain[at] : gain[at];
        scaled[at] = rest[at] * bias->squares[k];
      }
    }
    transpose(rest, transposed);
    add_product(scaled, transposed, UNKNOWNS, UNKNOWNS, UNKNOWNS,
                factor * (part ? 1.0 - bias->of_depth : bias->of_depth), sum);
  }
}

// Numbers that a difference between keypoints and depth shows of the ratio of the bias.
typedef struct {
  double square, information, score;
} Shown;

// Invert the covariance of a difference, and find what it shows; false where it is not definite.
static bool show(const Bias *of, const Expected *bias, double ratio, double largest,
                 Shown *shown) {
  double factor[SIZE], inverse[SIZE] = {0.0}, normalised[UNKNOWNS] = {0.0};
  memcpy(factor, of->covariance, sizeof(factor));
  for (int i = 0; i < UNKNOWNS; ++i) {
    factor[(UNKNOWNS + 1) * i] += ratio * bias->squares[i];
    inverse[(UNKNOWNS + 1) * i] = 1.0;
  }
  if (!factorize(factor, UNKNOWNS))
    return false;
  substitute(factor, UNKNOWNS, inverse, UNKNOWNS);
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
