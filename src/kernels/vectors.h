// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Vectors of three numbers.

#ifndef AICK_ROS_VECTORS_H
#define AICK_ROS_VECTORS_H

static inline double dot(const double *a, const double *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// A point moved by a pose, 4x4.
static inline void transform(const double *pose, const double *point, double *moved) {
  for (int i = 0; i < 3; ++i)
    moved[i] = dot(pose + 4 * i, point) + pose[4 * i + 3];
}

// How far a point moves along a direction by each number of a twist: (n, p x n). Of a point that
// a pose has rotated but not translated, it is the derivative by the error of the pose.
static inline void by_twist(const double *direction, const double *point, double *moved) {
  for (int i = 0; i < 3; ++i)
    moved[i] = direction[i];
  moved[3] = point[1] * direction[2] - point[2] * direction[1];
  moved[4] = point[2] * direction[0] - point[0] * direction[2];
  moved[5] = point[0] * direction[1] - point[1] * direction[0];
}

#endif
