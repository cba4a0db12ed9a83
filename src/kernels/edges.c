// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Distances of points on the edges of one depth image from the edges of another.

#include <math.h>

#include "arrays.h"
#include "blocks.h"
#include "kernels.h"
#include "vectors.h"

// The edges of the target: their cells and, of each cell of the image, the nearest of them.
typedef struct {
  const double *intrinsics;  // fx, fy, cx, cy
  const int64_t *nearest, (*cells)[2];
  const double *depths, (*across)[2];
  Size size;
  Py_ssize_t count;
} Edges;

// What is the same edge.
typedef struct {
  double reach, depth_error, cosine;
} Same;

// The edge point beside a point of the target's frame, with its distance across the edge; -1 where
// there is none.
static int64_t beside(const Edges *edges, const Same *same, const double *point,
                      const double *across, double *distance) {
  const double *camera = edges->intrinsics;
  const double column = point[0] / point[2] * camera[0] + camera[2];
  const double row = point[1] / point[2] * camera[1] + camera[3];
  const double i = rint(row), j = rint(column);
  if (!(point[2] > 0.0 && i >= 0.0 && i < (double)edges->size.height && j >= 0.0 &&
        j < (double)edges->size.width))
    return -1;
  const int64_t at = edges->nearest[edges->size.width * (Py_ssize_t)i + (Py_ssize_t)j];
  if (at < 0 || at >= edges->count)
    return -1;
  const double x = column - (double)edges->cells[at][0], y = row - (double)edges->cells[at][1];
  const double *normal = edges->across[at], depth = edges->depths[at];
  *distance = normal[0] * x + normal[1] * y;
  return hypot(x, y) < same->reach && fabs(point[2] - depth) < same->depth_error * depth &&
                 normal[0] * across[0] + normal[1] * across[1] > same->cosine
             ? at
             : -1;
}

// Set the derivatives of the distance by the error of the pose, about its position.
static void differentiate(const Edges *edges, const double *normal, const double *point,
                          const double *pose, double *jacobian) {
  const double x = point[0] / point[2], y = point[1] / point[2];
  const double arm[3] = {point[0] - pose[3], point[1] - pose[7], point[2] - pose[11]};
  double slope[3] = {normal[0] * edges->intrinsics[0] / point[2],
                     normal[1] * edges->intrinsics[1] / point[2]};
  slope[2] = -(slope[0] * x + slope[1] * y);
  by_twist(slope, arm, jacobian);
}

PyObject *kernel_edge_distances(PyObject *module, PyObject *arguments) {
  PyObject *objects[11];
  Same same;
  if (!PyArg_ParseTuple(arguments, "OOOOOOOOdddOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &objects[5], &objects[6], &objects[7],
                        &same.reach, &same.depth_error, &same.cosine, &objects[8], &objects[9],
                        &objects[10]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]);
  Edges edges = {.count = row_count(objects[5])};
  const Argument needed[] = {
      {"the points", objects[0], 'd', 3 * count, false},
      {"the directions", objects[1], 'd', 2 * count, false},
      {"the pose", objects[2], 'd', 16, false},
      {"the intrinsics", objects[3], 'd', 4, false},
      {"the nearest points", objects[4], 'q', IMAGE, false},
      {"the cells", objects[5], 'q', 2 * edges.count, false},
      {"the depths", objects[6], 'd', edges.count, false},
      {"the other directions", objects[7], 'd', 2 * edges.count, false},
      {"the distances", objects[8], 'd', count, true},
      {"the jacobian", objects[9], 'd', 6 * count, true},
      {"the blocks", objects[10], 'q', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const double(*points)[3] = views[0].buf, (*across)[2] = views[1].buf, *pose = views[2].buf;
  edges.intrinsics = views[3].buf;
  edges.nearest = views[4].buf;
  edges.size = size_of(&views[4]);
  edges.cells = views[5].buf;
  edges.depths = views[6].buf;
  edges.across = views[7].buf;
  double *distances = views[8].buf, (*jacobian)[6] = views[9].buf;
  int64_t *blocks = views[10].buf;
  Py_ssize_t found = 0;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    double point[3];
    transform(pose, points[i], point);
    const int64_t at = beside(&edges, &same, point, across[i], &distances[found]);
    if (at < 0)
      continue;
    differentiate(&edges, edges.across[at], point, pose, jacobian[found]);
    blocks[found++] = block_at(point[0] / point[2], point[1] / point[2]);
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}
