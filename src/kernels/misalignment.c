// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Derivatives of residuals by the misalignment of a camera and by the distortion of its depth.

#include <math.h>
#include <stdint.h>

#include "arrays.h"
#include "kernels.h"
#include "vectors.h"

enum { POSE = 6, UNKNOWNS = 14 };  // a row: pose 6, offset 6, delay, readout

static double along_twist(const double *moved, const double *twist) {
  return dot(moved, twist) + dot(moved + 3, twist + 3);
}

// The row that a point projects to: 0 on the optical axis, 1 is all rows.
static double row_of(const double *point, double height) {
  const double row = point[1] / (point[2] * height);
  return row > -1.0 ? (row < 1.0 ? row : 1.0) : -1.0;
}

// A pair of frames and how their cameras move.
typedef struct {
  const double *pose;       // T_target_source, 4x4
  const double *twists[2];  // of the source and of the target
  const double *heights;    // of both images on the plane z = 1
} Motion;

static void to_target(const Motion *motion, const double *point, double *moved) {
  for (int i = 0; i < 3; ++i)
    moved[i] = dot(motion->pose + 4 * i, point) + motion->pose[4 * i + 3];
}

// A direction of the target in the axes of the source.
static void to_source_axes(const Motion *motion, const double *direction, double *turned) {
  for (int i = 0; i < 3; ++i)
    turned[i] = motion->pose[i] * direction[0] + motion->pose[4 + i] * direction[1] +
                motion->pose[8 + i] * direction[2];
}

static void to_source(const Motion *motion, const double *moved, double *point) {
  const double *pose = motion->pose;
  const double from[3] = {moved[0] - pose[3], moved[1] - pose[7], moved[2] - pose[11]};
  to_source_axes(motion, from, point);
}

// How far a point moves along a direction by a unit of readout time of a frame.
static double by_readout(const Motion *motion, int frame, const double *direction,
                         const double *point) {
  double moved[6];
  by_twist(direction, point, moved);
  return row_of(point, motion->heights[frame]) * along_twist(moved, motion->twists[frame]);
}

static void open_motion(Arrays *arrays, Motion *motion, int first) {
  motion->pose = arrays->views[first].buf;
  const double *twists = arrays->views[first + 1].buf;
  motion->twists[0] = twists;
  motion->twists[1] = twists + 6;
  motion->heights = arrays->views[first + 2].buf;
}

// The row of a coordinate of a keypoint, whose depth changes with the surface that it is on.
static void keypoint_row(const Motion *motion, const double *jacobian, const double *point,
                         const double *normal, double smallest_cosine, double *row) {
  const double ray[3] = {point[0] / point[2], point[1] / point[2], 1.0};
  double depths[6], in_source[3], moved[3];
  by_twist(normal, point, depths);
  const double cosine = fmax(dot(normal, ray), smallest_cosine);
  to_source_axes(motion, jacobian, in_source);
  to_target(motion, point, moved);
  const double along_ray = dot(in_source, ray) / cosine;
  for (int i = 0; i < POSE; ++i) {
    row[i] = jacobian[i];
    row[POSE + i] = along_ray * depths[i];
  }
  row[12] = along_twist(row + POSE, motion->twists[0]);
  row[13] = by_readout(motion, 0, in_source, point) - by_readout(motion, 1, jacobian, moved);
}

PyObject *kernel_keypoint_rows(PyObject *module, PyObject *arguments) {
  PyObject *objects[9];
  double smallest_cosine;
  if (!PyArg_ParseTuple(arguments, "OOOOOOOOdO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &objects[5], &objects[6], &objects[7],
                        &smallest_cosine, &objects[8]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]), found = row_count(objects[1]);
  const Py_ssize_t size = row_count(objects[3]);
  const Argument needed[] = {
      {"the points", objects[0], 'd', 3 * count, false},
      {"the indices", objects[1], 'q', found, false},
      {"the cells", objects[2], 'q', found, false},
      {"the normals", objects[3], 'f', 3 * size, false},
      {"the jacobian", objects[4], 'd', 2 * POSE * count, false},
      {"the pose", objects[5], 'd', 16, false},
      {"the twists", objects[6], 'd', 12, false},
      {"the heights", objects[7], 'd', 2, false},
      {"the rows", objects[8], 'd', 2 * UNKNOWNS * found, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *jacobian = arrays.views[4].buf;
  const int64_t *indices = arrays.views[1].buf, *cells = arrays.views[2].buf;
  const float *normals = arrays.views[3].buf;
  double *rows = arrays.views[8].buf;
  Motion motion;
  open_motion(&arrays, &motion, 5);
  bool are_rows = true;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < found && are_rows; ++n) {
    const int64_t i = indices[n], cell = cells[n];
    are_rows = i >= 0 && i < count && cell >= 0 && cell < size;
    if (!are_rows)
      continue;
    const float *of_cell = normals + 3 * cell;
    const double normal[3] = {of_cell[0], of_cell[1], of_cell[2]};
    for (int k = 0; k < 2; ++k)
      keypoint_row(&motion, jacobian + POSE * (k * count + i), points + 3 * i, normal,
                   smallest_cosine, rows + UNKNOWNS * (k * found + n));
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_rows) {
    PyErr_SetString(PyExc_ValueError, "an index is not that of a point or of a cell");
    return NULL;
  }
  Py_RETURN_NONE;
}

PyObject *kernel_depth_rows(PyObject *module, PyObject *arguments) {
  PyObject *objects[7];
  if (!PyArg_ParseTuple(arguments, "OOOOOOO", &objects[0], &objects[1], &objects[2], &objects[3],
                        &objects[4], &objects[5], &objects[6]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]);
  const Argument needed[] = {
      {"the points", objects[0], 'd', 3 * count, false},
      {"the directions", objects[1], 'd', 3 * count, false},
      {"the jacobian", objects[2], 'd', POSE * count, false},
      {"the pose", objects[3], 'd', 16, false},
      {"the twists", objects[4], 'd', 12, false},
      {"the heights", objects[5], 'd', 2, false},
      {"the rows", objects[6], 'd', UNKNOWNS * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *directions = arrays.views[1].buf;
  const double *jacobian = arrays.views[2].buf;
  double *rows = arrays.views[6].buf;
  Motion motion;
  open_motion(&arrays, &motion, 3);
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    const double *moved = points + 3 * n, *in_target = directions + 3 * n;
    double point[3], in_source[3], of_source[6], of_target[6], *row = rows + UNKNOWNS * n;
    to_source(&motion, moved, point);
    to_source_axes(&motion, in_target, in_source);
    by_twist(in_source, point, of_source);
    by_twist(in_target, moved, of_target);
    for (int i = 0; i < POSE; ++i) {
      row[i] = jacobian[POSE * n + i];
      row[POSE + i] = of_source[i] - of_target[i];
    }
    row[12] = along_twist(of_source, motion.twists[0]) - along_twist(of_target, motion.twists[1]);
    row[13] = by_readout(&motion, 0, in_source, point) - by_readout(&motion, 1, in_target, moved);
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

static double limited(double value, double most) {
  return value > 0.0 ? (value < most ? value : most) : 0.0;
}

PyObject *kernel_nodes_around(PyObject *module, PyObject *arguments) {
  PyObject *place_array, *node_array, *weight_array;
  Py_ssize_t rows, columns;
  if (!PyArg_ParseTuple(arguments, "OnnOO", &place_array, &rows, &columns, &node_array,
                        &weight_array))
    return NULL;
  if (rows < 2 || columns < 2 || rows > LONGEST || columns > LONGEST) {
    PyErr_Format(PyExc_ValueError, "%zd rows and %zd columns of nodes: 2 to %zd are required",
                 rows, columns, LONGEST);
    return NULL;
  }
  const Py_ssize_t count = row_count(place_array);
  const Argument needed[] = {
      {"the places", place_array, 'd', 2 * count, false},
      {"the nodes", node_array, 'q', 4 * count, true},
      {"the weights", weight_array, 'd', 4 * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *places = arrays.views[0].buf;
  int64_t(*nodes)[4] = arrays.views[1].buf;
  double(*weights)[4] = arrays.views[2].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count; ++n) {
    const double column = limited(places[2 * n], (double)(columns - 1));
    const double row = limited(places[2 * n + 1], (double)(rows - 1));
    const Py_ssize_t left = column < (double)(columns - 2) ? (Py_ssize_t)column : columns - 2;
    const Py_ssize_t top = row < (double)(rows - 2) ? (Py_ssize_t)row : rows - 2;
    const double right = column - (double)left, down = row - (double)top;
    for (int i = 0; i < 4; ++i) {
      nodes[n][i] = (top + i / 2) * columns + left + i % 2;
      weights[n][i] = (i % 2 ? right : 1.0 - right) * (i / 2 ? down : 1.0 - down);
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_distortion_rows(PyObject *module, PyObject *arguments) {
  PyObject *objects[7];
  double sign;
  if (!PyArg_ParseTuple(arguments, "OOOOdOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &sign, &objects[4], &objects[5], &objects[6]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]), size = row_count(objects[4]);
  const Argument needed[] = {
      {"the points", objects[0], 'd', 3 * count, false},
      {"the directions", objects[1], 'd', 3 * count, false},
      {"the nodes around", objects[2], 'q', 4 * count, false},
      {"the weights", objects[3], 'd', 4 * count, false},
      {"the distortion", objects[4], 'd', size, false},
      {"the rows", objects[5], 'd', size * count, true},
      {"the applied", objects[6], 'd', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double *points = arrays.views[0].buf, *directions = arrays.views[1].buf;
  const int64_t *nodes = arrays.views[2].buf;
  const double *weights = arrays.views[3].buf, *distortion = arrays.views[4].buf;
  double *rows = arrays.views[5].buf, *applied = arrays.views[6].buf;
  bool are_nodes = true;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t n = 0; n < count && are_nodes; ++n) {
    // an error of the inverse depth moves a point p by -z p
    const double *point = points + 3 * n;
    const double along = sign * point[2] * dot(directions + 3 * n, point);
    for (Py_ssize_t i = 4 * n; i < 4 * n + 4 && are_nodes; ++i) {
      const int64_t node = nodes[i];
      are_nodes = node >= 0 && node < size;
      if (are_nodes) {
        rows[size * n + node] += along * weights[i];
        applied[n] += along * weights[i] * distortion[node];
      }
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_nodes) {
    PyErr_SetString(PyExc_ValueError, "a number is not that of a node");
    return NULL;
  }
  Py_RETURN_NONE;
}
