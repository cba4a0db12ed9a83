// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Robust weights of residuals of which at most half are outliers: those of the cost of Geman and
// McClure (1985), whose width grows with the median of the squares.
//
// Tracks may be on an object that moves by itself and has more than half of the keypoints. The
// smallest squares tell what is noise, and what is so much larger that it must be another motion
// has no weight at all.

#ifndef AICK_ROS_WEIGHTS_H
#define AICK_ROS_WEIGHTS_H

#include "arrays.h"

typedef struct {
  double width;    // in standard deviations of the noise, or of the residuals if these are larger
  double typical;  // median of the squares if noise alone causes them
  double most;     // largest ratio of their median to that
} Robustness;

typedef struct {
  double most;   // in standard deviations of the noise; beyond it is another motion
  double least;  // smallest ratio of what the squares show to the noise
} Truncation;

// Set the weights of residuals of one number each.
void weigh(const double *values, Py_ssize_t count, const Robustness *by, double *weights);

// Set the weights of residuals of two numbers, of which the second ones follow behind all first
// ones, as the weights do.
void weigh_pairs(const double *values, Py_ssize_t count, const Robustness *by,
                 const Truncation *truncation, double *weights);

#endif
