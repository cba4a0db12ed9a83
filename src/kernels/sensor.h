// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Noise of a depth sensor.

#ifndef AICK_ROS_SENSOR_H
#define AICK_ROS_SENSOR_H

#include <math.h>

typedef struct {
  double sigma;     // standard deviation of the inverse depth at one metre
  double exponent;  // of the depth, by whose power it grows
} DepthNoise;

// The standard deviation of the inverse depth: a power of the depth, often the same for all.
static inline double inverse_depth_sigma(double z, DepthNoise noise) {
  return noise.exponent == 0.0 ? noise.sigma : noise.sigma * pow(z, noise.exponent);
}

#endif
