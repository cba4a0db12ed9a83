// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "weights.h"

#include <string.h>

#include "order.h"
#include "processors.h"

static double median(double *values, Py_ssize_t count) {
  const Py_ssize_t middle = count / 2;
  const double above = selected(values, count, middle);
  if (count % 2)
    return above;
  double below = values[0];
  for (Py_ssize_t i = 1; i < middle; ++i)
    below = values[i] > below ? values[i] : below;
  return 0.5 * (below + above);
}

// The square of the width that some squares give, one or more, which are put into another order.
static double limit_by(double *squares, Py_ssize_t count, const Robustness *by) {
  const double scale = median(squares, count) / by->typical;
  return by->width * by->width * (scale > 1.0 ? (scale < by->most ? scale : by->most) : 1.0);
}

// Up to 70 % of the residuals may be those of another motion. Chosen: in one of eight rendered
// rooms through which a board passes 0.4 leaves an error of 29 and 40 mm where 0.3 leaves 2 and 3.
static const double SHARE = 0.3;
// Its quantile, of squares that are chi-square with two degrees of freedom: -2 ln 0.7.
static const double TYPICAL = 0.71334988787746478;

// The largest square that is not another motion, by squares that are put into another order.
static double most_by(double *squares, Py_ssize_t count, const Truncation *by) {
  const double scale = selected(squares, count, (Py_ssize_t)(SHARE * (double)count)) / TYPICAL;
  return by->most * by->most * (scale > by->least ? scale : by->least);
}

static inline double weight(double square, double limit) {
  const double root = 1.0 / (1.0 + square / limit);
  return root * root;
}

FOR_EACH_PROCESSOR
void weigh(const double *values, Py_ssize_t count, const Robustness *by, double *weights) {
  if (count == 0)
    return;
  for (Py_ssize_t i = 0; i < count; ++i)
    weights[i] = values[i] * values[i];
  const double limit = limit_by(weights, count, by);
  for (Py_ssize_t i = 0; i < count; ++i)
    weights[i] = weight(values[i] * values[i], limit);
}

FOR_EACH_PROCESSOR
void weigh_pairs(const double *values, Py_ssize_t count, const Robustness *by,
                 const Truncation *truncation, double *weights) {
  if (count == 0)
    return;
  double *squares = weights + count;
  for (Py_ssize_t i = 0; i < count; ++i)
    weights[i] = values[i] * values[i] + values[count + i] * values[count + i];
  memcpy(squares, weights, (size_t)count * sizeof(*squares));
  const double most = most_by(squares, count, truncation);
  const double limit = limit_by(squares, count, by);
  for (Py_ssize_t i = 0; i < count; ++i)
    weights[i] = weights[i] > most ? 0.0 : weight(weights[i], limit);
  memcpy(squares, weights, (size_t)count * sizeof(*squares));
}
