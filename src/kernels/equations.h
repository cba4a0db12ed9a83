// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Normal equations of residuals, six unknowns each.

#ifndef AICK_ROS_EQUATIONS_H
#define AICK_ROS_EQUATIONS_H

#include "arrays.h"

// Add the weighted products of rows of a Jacobian with themselves, 6x6, and with their values, 6.
void add_equations(const double *jacobian, const double *values, const double *weights,
                   Py_ssize_t count, double *information, double *gradient);

#endif
