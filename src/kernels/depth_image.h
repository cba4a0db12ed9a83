// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// A depth between pixels.

#ifndef AICK_ROS_DEPTH_IMAGE_H
#define AICK_ROS_DEPTH_IMAGE_H

#include <math.h>

#include "arrays.h"

typedef struct {
  const float *depths;
  Size size;
} DepthImage;

typedef struct {
  double jump, nearest, farthest;
} DepthRange;

// Keep a coordinate within 0 to a length less 1; NaN becomes 0.
static inline double clamped(double value, Py_ssize_t length) {
  const double last = (double)(length - 1);
  return value > 0.0 ? (value < last ? value : last) : 0.0;
}

static inline double least(double a, double b) { return a < b ? a : b; }

static inline double most(double a, double b) { return a > b ? a : b; }

// The first of two neighbours that a coordinate lies between.
static inline Py_ssize_t first_of_two(double value, Py_ssize_t length) {
  const Py_ssize_t first = (Py_ssize_t)clamped(value, length);
  return first <= length - 2 ? first : (length > 1 ? length - 2 : 0);
}

// Fetch the pixels around a place.
static inline void fetch_depth(const DepthImage *image, const double *pixel) {
  const Py_ssize_t row = first_of_two(pixel[1], image->size.height);
  const float *corner =
      image->depths + row * image->size.width + first_of_two(pixel[0], image->size.width);
  __builtin_prefetch(corner);
  __builtin_prefetch(corner + (image->size.height > 1 ? image->size.width : 0));
}

// The depth at a pixel; NaN out of the range.
static inline double depth_at(const DepthImage *image, double u, double v,
                              const DepthRange *range) {
  const Py_ssize_t column = first_of_two(u, image->size.width);
  const Py_ssize_t row = first_of_two(v, image->size.height);
  u = clamped(u, image->size.width);
  v = clamped(v, image->size.height);
  const double right = u - (double)column, down = v - (double)row;
  const Py_ssize_t beside = image->size.width > 1;
  const Py_ssize_t below = image->size.height > 1 ? image->size.width : 0;
  const float *corner = image->depths + row * image->size.width + column;
  const double a = corner[0], b = corner[beside], c = corner[below], d = corner[below + beside];
  const double low = least(least(a, b), least(c, d)), high = most(most(a, b), most(c, d));
  double depth;
  // of NaN and infinity in a corner the sum makes NaN or infinity, and the comparison fails
  if (high - low <= range->jump * low && isfinite(a + b + c + d)) {
    depth = 1.0 / ((1.0 - right) * (1.0 - down) / a + right * (1.0 - down) / b +
                   (1.0 - right) * down / c + right * down / d);
  } else {
    depth = image->depths[(Py_ssize_t)rint(v) * image->size.width + (Py_ssize_t)rint(u)];
  }
  return depth >= range->nearest && depth <= range->farthest ? depth : NAN;
}

#endif
