// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Blocks of an image, whose residuals may have a common error.

#ifndef AICK_ROS_BLOCKS_H
#define AICK_ROS_BLOCKS_H

#include <stdint.h>

static const double BLOCK = 0.2;      // chosen: side of a block of the image, on the plane z = 1
static const double RAY_LIMIT = 2.0;  // chosen: rays farther out share the outer blocks
enum { BLOCKS_ACROSS = 21 };          // more than 2 RAY_LIMIT / BLOCK

static inline int64_t block_along(double ray) {
  const double limited = ray > -RAY_LIMIT ? (ray < RAY_LIMIT ? ray : RAY_LIMIT) : -RAY_LIMIT;
  return (int64_t)((limited + RAY_LIMIT) / BLOCK);
}

// The number of the block at a point on the plane z = 1.
static inline int64_t block_at(double x, double y) {
  return BLOCKS_ACROSS * block_along(x) + block_along(y);
}

#endif
