// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Projection by the cameras that sensor_msgs/CameraInfo describes.

#ifndef AICK_ROS_CAMERA_MODEL_H
#define AICK_ROS_CAMERA_MODEL_H

#include <math.h>

#include "lanes.h"

enum {
  CAMERA = 28,  // numbers of one
  COEFFICIENTS = 12,
};

typedef enum { POLYNOMIAL, TILTED, EQUIDISTANT } LensKind;

// Its numbers in their order: fx fy cx cy, the coefficients k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4
// of a rational polynomial as in OpenCV, or the four of the angle, what a tilted sensor does to
// (u, v, 1), 3x3, the kind of the lens, and the width and height of the image.
typedef struct {
  const double *focal, *coefficients, *tilt;
  LensKind kind;
  double width, height;
} CameraModel;

static inline CameraModel camera_of(const double *numbers) {
  const double *tilt = numbers + 4 + COEFFICIENTS, kind = tilt[9];
  return (CameraModel){numbers, numbers + 4, tilt,
                       kind == 1.0 ? TILTED : kind == 2.0 ? EQUIDISTANT : POLYNOMIAL, tilt[10],
                       tilt[11]};
}

// The height of the image on the plane z = 1.
static inline double image_height(const CameraModel *camera) {
  return camera->height / camera->focal[1];
}

// Where a rational polynomial puts rays (x, y, 1).
INLINE void distort(Doubles x, Doubles y, const double *d, Doubles *u, Doubles *v) {
  const Doubles r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2, xy = 2.0 * x * y;
  const Doubles radial = (1.0 + d[0] * r2 + d[1] * r4 + d[4] * r6) /
                         (1.0 + d[5] * r2 + d[6] * r4 + d[7] * r6);
  *u = x * radial + d[2] * xy + d[3] * (r2 + 2.0 * x * x) + d[8] * r2 + d[9] * r4;
  *v = y * radial + d[2] * (r2 + 2.0 * y * y) + d[3] * xy + d[10] * r2 + d[11] * r4;
}

INLINE void tilt(const double *m, Doubles *u, Doubles *v) {
  const Doubles x = *u, y = *v, scale = 1.0 / (m[6] * x + m[7] * y + m[8]);
  *u = (m[0] * x + m[1] * y + m[2]) * scale;
  *v = (m[3] * x + m[4] * y + m[5]) * scale;
}

// Where a lens puts rays whose distance from the centre is their angle to the axis, nearly.
INLINE void bend(Doubles x, Doubles y, const double *k, Doubles *u, Doubles *v) {
  Doubles scale;
  for (int lane = 0; lane < FOUR; ++lane) {
    const double radius = hypot(x[lane], y[lane]), angle = atan(radius), square = angle * angle;
    const double seen =
        angle * (1.0 + square * (k[0] + square * (k[1] + square * (k[2] + square * k[3]))));
    scale[lane] = radius > 0.0 ? seen / radius : 1.0;
  }
  *u = x * scale;
  *v = y * scale;
}

// The pixels of places on the plane z = 1 of a camera without a lens.
INLINE void to_pixels(const double *focal, Doubles *u, Doubles *v) {
  *u = focal[0] * *u + focal[2];
  *v = focal[1] * *v + focal[3];
}

// The pixels of rays (x, y, 1).
INLINE void see(Doubles x, Doubles y, const CameraModel *camera, Doubles *u, Doubles *v) {
  if (camera->kind == EQUIDISTANT)
    bend(x, y, camera->coefficients, u, v);
  else
    distort(x, y, camera->coefficients, u, v);
  if (camera->kind == TILTED)
    tilt(camera->tilt, u, v);
  to_pixels(camera->focal, u, v);
}

// The pixels of points, of up to four of them.
INLINE void project(const double *points, Py_ssize_t count, const CameraModel *camera,
                    double *pixels) {
  Doubles x, y, z, u, v;
  for (int lane = 0; lane < FOUR; ++lane) {
    const double *point = points + 3 * (lane < count ? lane : 0);
    x[lane] = point[0];
    y[lane] = point[1];
    z[lane] = point[2] != 0.0 ? point[2] : 1.0;
  }
  const Doubles inverse = 1.0 / z;
  see(x * inverse, y * inverse, camera, &u, &v);
  for (int lane = 0; lane < FOUR && lane < count; ++lane) {
    pixels[2 * lane] = u[lane];
    pixels[2 * lane + 1] = v[lane];
  }
}

#endif
