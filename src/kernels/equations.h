// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Normal equations of residuals, six unknowns each.

#ifndef AICK_ROS_EQUATIONS_H
#define AICK_ROS_EQUATIONS_H

#include <stdint.h>

#include "arrays.h"
#include "lanes.h"

enum { UNKNOWNS = 6 };

// Sums of the products of rows with themselves and with their values: of columns 0 to 3, and of
// those behind them and the values. What fills them in a loop keeps them in registers.
typedef struct {
  Doubles left[FOUR], right[UNKNOWNS];
} Products;

INLINE void add_row(const double *row, double value, double weight, Products *to) {
  const Doubles first = {row[0], row[1], row[2], row[3]}, last = {row[4], row[5], value, 0.0};
  for (int k = 0; k < UNKNOWNS; ++k) {
    const double scaled = weight * row[k];
    if (k < FOUR)
      to->left[k] += scaled * first;
    to->right[k] += scaled * last;
  }
}

// Add the products of the rows with themselves, times a factor, to a matrix.
INLINE void add_squares(const Products *products, double factor, double *matrix) {
  for (int k = 0; k < UNKNOWNS; ++k) {
    for (int n = k; n < UNKNOWNS; ++n) {
      const double sum = n < FOUR ? products->left[k][n] : products->right[k][n - FOUR];
      matrix[UNKNOWNS * k + n] += factor * sum;
      if (n > k)
        matrix[UNKNOWNS * n + k] += factor * sum;
    }
  }
}

// Add the weighted products of rows of a Jacobian with themselves, 6x6, and with their values, 6.
void add_equations(const double *jacobian, const double *values, const double *weights,
                   Py_ssize_t count, double *information, double *gradient);

// Residuals of one kind, with the blocks of the image that they are from.
typedef struct {
  const double *jacobian, *values, *weights;
  const int64_t *blocks;
  Py_ssize_t count;
} Kind;

// A number that all blocks are below; -1, with a ValueError, where one is out of range.
Py_ssize_t end_of_blocks(const Kind *kind);

// Add the covariance of the gradient by what an error leaves of the residuals, whose blocks are
// below a number; return false where there is no memory.
bool add_gradient_noise(const Kind *kind, Py_ssize_t end, const double *error, double *noise);

#endif
