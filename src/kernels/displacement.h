// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Displacement of points by twists that are linear in the rows of an image.

#ifndef AICK_ROS_DISPLACEMENT_H
#define AICK_ROS_DISPLACEMENT_H

#include <stddef.h>

typedef struct {
  const double *constant, *by_row;  // twists
  double height;                    // of the image on the plane z = 1
} Displacement;

// Return v + w x p of a twist (v, w), without v where that is not wanted.
static inline void twisted(const double *v, const double *w, const double *p, double *moved) {
  moved[0] = (v ? v[0] : 0.0) + w[1] * p[2] - w[2] * p[1];
  moved[1] = (v ? v[1] : 0.0) + w[2] * p[0] - w[0] * p[2];
  moved[2] = (v ? v[2] : 0.0) + w[0] * p[1] - w[1] * p[0];
}

// Displace a point, to second order.
static inline void displace(const Displacement *by, const double *p, double *moved) {
  double row = p[1] / (p[2] * by->height);
  row = row < -1.0 ? -1.0 : (row > 1.0 ? 1.0 : row);
  double twist[6], step[3], turn[3];
  for (int i = 0; i < 6; ++i)
    twist[i] = by->constant[i] + row * by->by_row[i];
  twisted(twist, twist + 3, p, step);
  twisted(NULL, twist + 3, step, turn);
  for (int i = 0; i < 3; ++i)
    moved[i] = p[i] + step[i] + 0.5 * turn[i];
}

#endif
