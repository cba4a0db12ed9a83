// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Linear equations with a positive definite matrix.

#ifndef AICK_ROS_CHOLESKY_H
#define AICK_ROS_CHOLESKY_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdbool.h>

enum { MOST_UNKNOWNS = 64 };

// Replace the lower triangle of a matrix by its Cholesky factor, with inverse pivots on the
// diagonal; return false where the matrix is not positive definite, or not finite.
bool factorize(double *matrix, Py_ssize_t size);

// Replace the right sides by the solutions of the equations of the factor alone.
void substitute_down(const double *factor, Py_ssize_t size, double *sides, Py_ssize_t count);

// Replace the right sides, a row for each equation, by the solutions.
void substitute(const double *factor, Py_ssize_t size, double *sides, Py_ssize_t count);

// Fill the inverse of a matrix, of up to MOST_UNKNOWNS rows; return false where the matrix is not
// positive definite.
bool invert(const double *matrix, Py_ssize_t size, double *inverse);

#endif
