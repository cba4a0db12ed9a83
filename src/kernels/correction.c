// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Tracks as a camera without misalignment would see them.

#include <math.h>
#include <string.h>

#include "arrays.h"
#include "camera_model.h"
#include "depth_image.h"
#include "displacement.h"
#include "kernels.h"
#include "processors.h"
#include "se3.h"
#include "vectors.h"

enum {
  DEPTH_STEPS = 2,  // chosen: of the search along a ray
  LENS_STEPS = 4,   // chosen: of Newton's method; 0.3 at a radius of 0.75 is inverted to rounding
};

static const double LEAST_SLOPE = 0.2;  // chosen: of the radius shown by that of the ray
static const double OUTERMOST = 1.5;    // by definition: ratio where a lens shows no larger radius

// How the two frames of tracks are corrected.
typedef struct {
  DepthImage image;  // of the source
  DepthRange range;
  CameraModel camera;
  const double *T_depth_colour, *T_target_source;  // poses, 4x4
  Displacement source, target;                     // by the rows of the colour images
  Displacement onto_depth;  // of what the depth image of the source shows at the same rows
  double colour_focal, depth_focal;  // focal lengths of the images by that of the camera
  double colour_radial;              // coefficient of the square of the radius
} Correction;

static bool is_still(const Displacement *displacement) {
  for (int i = 0; i < 6; ++i)
    if (displacement->by_row[i] != 0.0)
      return false;
  return true;
}

// Move some points by their rows.
INLINE void move_points(const Displacement *by, int count, double (*points)[3]) {
  Column before[3] = {{0}}, after[3];
  for (int n = 0; n < count; ++n)
    for (int i = 0; i < 3; ++i)
      before[i][n] = points[n][i];
  displace(by, before, after);
  for (int n = 0; n < count; ++n)
    for (int i = 0; i < 3; ++i)
      points[n][i] = after[i][n];
}

// Move some points of the source along their rays to where the depth image has a surface.
INLINE void put_on_surface(const Correction *by, bool are_rows_alike, int count,
                           double (*points)[3]) {
  for (int step = 0; step < DEPTH_STEPS; ++step) {
    double seen[BATCH][3], pixels[BATCH][2];
    for (int n = 0; n < count; ++n) {
      transform(by->T_depth_colour, points[n], seen[n]);
      seen[n][0] *= by->depth_focal;
      seen[n][1] *= by->depth_focal;
    }
    if (!are_rows_alike)
      move_points(&by->onto_depth, count, seen);
    for (int n = 0; n < count; n += FOUR)
      project(seen[n], count - n, &by->camera, pixels[n]);
    for (int n = 0; n < count; ++n)
      fetch_depth(&by->image, pixels[n]);
    for (int n = 0; n < count; ++n) {
      const double scale =
          depth_at(&by->image, pixels[n][0], pixels[n][1], &by->range) / seen[n][2];
      for (int i = 0; i < 3 && isfinite(scale); ++i)
        points[n][i] *= scale;
    }
  }
}

// The ratio of the radius of a ray to that of where a lens shows it: inverts r (1 + k r^2).
static double straightened(double radial, double x, double y) {
  const double bend = radial * (x * x + y * y);
  double ratio = 1.0;
  for (int step = 0; step < LENS_STEPS; ++step) {
    const double bent = bend * ratio * ratio;
    ratio -= (ratio * (1.0 + bent) - 1.0) / fmax(1.0 + 3.0 * bent, LEAST_SLOPE);
    ratio = fmin(ratio, OUTERMOST);
  }
  return ratio;
}

// Turn the rays of some points, and some rays, to where the colour camera sees them.
INLINE void put_on_rays(const Correction *by, int count, double (*points)[3], double (*rays)[2]) {
  for (int n = 0; n < count; ++n) {
    double *point = points[n], *ray = rays[n];
    for (int i = 0; i < 2; ++i) {
      point[i] /= by->colour_focal;
      ray[i] /= by->colour_focal;
    }
    if (by->colour_radial == 0.0)
      continue;
    const double of_point =
        straightened(by->colour_radial, point[0] / point[2], point[1] / point[2]);
    const double of_ray = straightened(by->colour_radial, ray[0], ray[1]);
    for (int i = 0; i < 2; ++i) {
      point[i] *= of_point;
      ray[i] *= of_ray;
    }
  }
}

// Move some rays of the target as moving the rows of what they see does.
INLINE void move_rays(const Correction *by, int count, const double (*points)[3],
                      double (*rays)[2]) {
  const double *pose = by->T_target_source;
  Column seen[3] = {{0}}, after[3];
  for (int n = 0; n < count; ++n) {
    const double depth = dot(pose + 8, points[n]) + pose[11];
    seen[0][n] = rays[n][0] * depth;
    seen[1][n] = rays[n][1] * depth;
    seen[2][n] = depth;
  }
  displace(&by->target, seen, after);
  for (int n = 0; n < count; ++n)
    for (int i = 0; i < 2; ++i)
      rays[n][i] = after[i][n] / after[2][n];
}

FOR_EACH_PROCESSOR
static void correct(const Correction *by, Py_ssize_t count, double (*points)[3],
                    double (*rays)[2]) {
  const bool are_points_still = is_still(&by->source), are_rays_still = is_still(&by->target);
  const bool are_rows_alike = is_still(&by->onto_depth);
  for (Py_ssize_t first = 0; first < count; first += BATCH) {
    const int many = count - first < BATCH ? (int)(count - first) : BATCH;
    double(*some)[3] = points + first;
    put_on_rays(by, many, some, rays + first);
    put_on_surface(by, are_rows_alike, many, some);
    if (!are_points_still)
      move_points(&by->source, many, some);
    if (!are_rays_still)
      move_rays(by, many, (const double(*)[3])some, rays + first);
  }
}

PyObject *kernel_corrected_tracks(PyObject *module, PyObject *arguments) {
  PyObject *objects[9];
  Correction by;
  if (!PyArg_ParseTuple(arguments, "OdddOOdOddddOOOOO", &objects[0], &by.range.jump,
                        &by.range.nearest, &by.range.farthest, &objects[1], &objects[2],
                        &by.source.height, &objects[3], &by.target.height,
                        &by.colour_focal, &by.depth_focal, &by.colour_radial, &objects[4],
                        &objects[5], &objects[6], &objects[7], &objects[8]))
    return NULL;
  const Py_ssize_t count = row_count(objects[5]);
  const Argument needed[] = {
      {"the image", objects[0], 'f', IMAGE, false},
      {"the camera", objects[1], 'd', CAMERA, false},
      {"the twists of the source", objects[2], 'd', 18, false},
      {"the twists of the target", objects[3], 'd', 18, false},
      {"the pose", objects[4], 'd', 16, false},
      {"the points", objects[5], 'd', 3 * count, false},
      {"the rays", objects[6], 'd', 2 * count, false},
      {"the corrected points", objects[7], 'd', 3 * count, true},
      {"the corrected rays", objects[8], 'd', 2 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const double *source = views[2].buf, *target = views[3].buf, still[6] = {0};
  double towards_depth[6], T_depth_colour[16], by_rows[6];
  for (int i = 0; i < 6; ++i) {
    towards_depth[i] = -source[i];
    by_rows[i] = source[6 + i] - source[12 + i];
  }
  exp_pose(towards_depth, T_depth_colour);
  by.image = (DepthImage){views[0].buf, size_of(&views[0])};
  by.camera = camera_of(views[1].buf);
  by.T_depth_colour = T_depth_colour;
  by.T_target_source = views[4].buf;
  by.source.constant = by.target.constant = by.onto_depth.constant = still;
  by.source.by_row = source + 6;
  by.target.by_row = target + 6;
  by.onto_depth.by_row = by_rows;
  by.onto_depth.height = by.source.height;
  memcpy(views[7].buf, views[5].buf, (size_t)views[5].len);
  memcpy(views[8].buf, views[6].buf, (size_t)views[6].len);
  Py_BEGIN_ALLOW_THREADS
  correct(&by, count, views[7].buf, views[8].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
