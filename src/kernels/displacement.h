// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Displacement of points, many side by side, by twists that are linear in the rows of an image.

#ifndef AICK_ROS_DISPLACEMENT_H
#define AICK_ROS_DISPLACEMENT_H

enum { BATCH = 32 };  // points that are computed side by side

// A number of each of them: loops over it compute several at once.
typedef double Column[BATCH];

typedef struct {
  const double *constant, *by_row;  // twists
  double height;                    // of the image on the plane z = 1
} Displacement;

// The rows that points project to: 0 on the optical axis, 1 is all rows. In loops one after the
// other: of one that has both bounds, compilers make branches.
static inline void find_rows(Column *points, double height, Column rows) {
  for (int n = 0; n < BATCH; ++n)
    rows[n] = points[1][n] / (points[2][n] * height);
  for (int n = 0; n < BATCH; ++n)
    rows[n] = rows[n] < -1.0 ? -1.0 : rows[n];
  for (int n = 0; n < BATCH; ++n)
    rows[n] = rows[n] > 1.0 ? 1.0 : rows[n];
}

// Move the images of points away from the optical axis, by a factor.
static inline void widen(Column *points, double factor) {
  for (int i = 0; i < 2; ++i)
    for (int n = 0; n < BATCH; ++n)
      points[i][n] *= factor;
}

// Displace points, to second order.
static inline void displace(const Displacement *by, Column *points, Column *moved) {
  double constant[6], by_row[6];
  Column rows;
  find_rows(points, by->height, rows);
  for (int i = 0; i < 6; ++i) {
    constant[i] = by->constant[i];
    by_row[i] = by->by_row[i];
  }
  for (int n = 0; n < BATCH; ++n) {
    const double x = points[0][n], y = points[1][n], z = points[2][n];
    const double row = rows[n], a = constant[3] + row * by_row[3];
    const double b = constant[4] + row * by_row[4], c = constant[5] + row * by_row[5];
    // v + w x p of the twist (v, w) of the row, and its second order
    const double along_x = constant[0] + row * by_row[0] + b * z - c * y;
    const double along_y = constant[1] + row * by_row[1] + c * x - a * z;
    const double along_z = constant[2] + row * by_row[2] + a * y - b * x;
    moved[0][n] = x + along_x + 0.5 * (b * along_z - c * along_y);
    moved[1][n] = y + along_y + 0.5 * (c * along_x - a * along_z);
    moved[2][n] = z + along_z + 0.5 * (a * along_y - b * along_x);
  }
}

#endif
