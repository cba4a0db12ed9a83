// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Covariances of a Kalman filter; matrices row by row.

#ifndef AICK_ROS_KALMAN_H
#define AICK_ROS_KALMAN_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

enum { MOST_VALUES = 32 };

// Fill a covariance after a transition with noise, of up to MOST_VALUES values and noises; it is
// symmetric to the last bit.
void propagate(const double *transition, const double *covariance, const double *influence,
               const double *noise, Py_ssize_t size, Py_ssize_t count, double *result);

#endif
