// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Normal equations of the misalignment of a camera and of the distortion of its depth.

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "arrays.h"
#include "camera_model.h"
#include "kernels.h"
#include "processors.h"
#include "vectors.h"

enum {
  POSE = 6,
  UNKNOWNS = 18,  // of each residual: pose, offset, delay, two readouts, two focal lengths, lens
  AROUND = 4,     // nodes of the distortion around a point
  MOST_NODES = 1 << 10,
};

// Sums over residuals: the nodes of the distortion are the unknowns behind the others.
typedef struct {
  Py_ssize_t size;
  double *information;       // size x size, of which the upper right is filled in the end
  double *gradient;          // by the values of the residuals
  double *gradient_applied;  // by how far what is corrected already has changed them
} Equations;

// A residual and its derivatives, those by the distortion at the nodes around two points. None is
// cleared before it is filled: that would take as long as to add it.
typedef struct {
  double weight, value, applied;
  double derivatives[UNKNOWNS], by_nodes[2 * AROUND];
  int64_t nodes[2 * AROUND];
  int count;  // of those nodes: fewer, where they are the same around both points
} Row;

// Add the products of a row by the unknowns that each residual has, but those of the pose behind
// the others; the sums are of a size that is known, so that several are computed at once.
static inline void add_known(const Row *row, double (*products)[UNKNOWNS], double *gradient) {
  const double weighted_value = row->weight * row->value;
  for (int i = 0; i < UNKNOWNS; ++i)
    gradient[i] -= weighted_value * row->derivatives[i];
  for (int i = 0; i < POSE; ++i) {
    const double scaled = row->weight * row->derivatives[i];
    for (int j = 0; j < UNKNOWNS; ++j)
      products[i][j] += scaled * row->derivatives[j];
  }
  for (int i = POSE; i < UNKNOWNS; ++i) {
    const double scaled = row->weight * row->derivatives[i];
    for (int j = POSE; j < UNKNOWNS; ++j)
      products[i][j] += scaled * row->derivatives[j];
  }
}

// Add the products of a row with its derivatives by the distortion.
static inline void add_nodes(const Row *row, Equations *to) {
  const double weighted_value = row->weight * row->value;
  const double weighted_applied = row->weight * row->applied;
  for (int j = 0; j < UNKNOWNS; ++j)
    to->gradient_applied[j] += weighted_applied * row->derivatives[j];
  for (int k = 0; k < row->count; ++k) {
    const double scaled = row->weight * row->by_nodes[k];
    const Py_ssize_t unknown = UNKNOWNS + row->nodes[k];
    double *sums = to->information + to->size * unknown;
    to->gradient[unknown] -= weighted_value * row->by_nodes[k];
    to->gradient_applied[unknown] += weighted_applied * row->by_nodes[k];
    for (int j = 0; j < UNKNOWNS; ++j)
      sums[j] += scaled * row->derivatives[j];
    for (int n = 0; n < row->count; ++n)
      sums[UNKNOWNS + row->nodes[n]] += scaled * row->by_nodes[n];
  }
}

static void add_products(double (*products)[UNKNOWNS], Equations *to) {
  for (int i = 0; i < UNKNOWNS; ++i)
    for (int j = 0; j < UNKNOWNS; ++j)
      to->information[to->size * i + j] += j < i ? products[j][i] : products[i][j];
}

static double along_twist(const double *moved, const double *twist) {
  return dot(moved, twist) + dot(moved + 3, twist + 3);
}

// The row that a point projects to: 0 on the optical axis, 1 is all rows.
static double row_of(const double *point, double height) {
  const double row = point[1] / (point[2] * height);
  return row > -1.0 ? (row < 1.0 ? row : 1.0) : -1.0;
}

// How far a point moves along a direction where the focal length of its image is longer, by a
// unit of their ratio.
static double by_focal_length(const double *direction, const double *point) {
  return -direction[0] * point[0] - direction[1] * point[1];
}

// How far it moves along a direction where the lens bends rays more, by a unit of a coefficient
// of the square of the radius.
static double by_lens(const double *direction, const double *point) {
  const double square = point[0] * point[0] + point[1] * point[1];
  return by_focal_length(direction, point) * square / (point[2] * point[2]);
}

// A pair of frames and how their cameras move.
typedef struct {
  const double *pose;       // T_target_source, 4x4
  const double *twists[2];  // of the source and of the target
  CameraModel cameras[2];
} Motion;

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

// How far a point moves along a direction by a unit of readout time of an image.
static double by_readout(const Motion *motion, int frame, const double *direction,
                         const double *point) {
  double moved[6];
  by_twist(direction, point, moved);
  const double row = row_of(point, image_height(&motion->cameras[frame]));
  return row * along_twist(moved, motion->twists[frame]);
}

static void open_motion(Arrays *arrays, Motion *motion, int first) {
  motion->pose = arrays->views[first].buf;
  const double *twists = arrays->views[first + 1].buf;
  motion->twists[0] = twists;
  motion->twists[1] = twists + 6;
  for (int frame = 0; frame < 2; ++frame)
    motion->cameras[frame] = camera_of(arrays->views[first + 2 + frame].buf);
}

// The row of a coordinate of a keypoint, whose depth changes with the surface that it is on.
static void keypoint_row(const Motion *motion, const double *jacobian, const double *point,
                         const double *normal, double smallest_cosine, double *row) {
  const double ray[3] = {point[0] / point[2], point[1] / point[2], 1.0};
  double depths[6], in_source[3], moved[3];
  by_twist(normal, point, depths);
  const double cosine = fmax(dot(normal, ray), smallest_cosine);
  to_source_axes(motion, jacobian, in_source);
  transform(motion->pose, point, moved);
  const double along_ray = dot(in_source, ray) / cosine;
  for (int i = 0; i < POSE; ++i) {
    row[i] = jacobian[i];
    row[POSE + i] = along_ray * depths[i];
  }
  row[12] = along_twist(row + POSE, motion->twists[0]);
  row[14] = row[12] * row_of(point, image_height(&motion->cameras[0]));
  row[13] = by_readout(motion, 0, in_source, point) - by_readout(motion, 1, jacobian, moved) -
            row[14];
  row[16] = along_ray * by_focal_length(normal, point);
  row[15] = by_focal_length(in_source, point) - by_focal_length(jacobian, moved) - row[16];
  row[17] = by_lens(in_source, point) - by_lens(jacobian, moved) -
            along_ray * by_lens(normal, point);
}

// Return whether there are so many unknowns; false, with a ValueError, otherwise.
static bool is_size(Py_ssize_t size) {
  if (size >= UNKNOWNS && size <= UNKNOWNS + MOST_NODES)
    return true;
  PyErr_Format(PyExc_ValueError, "%zd are not the unknowns of equations of %d and nodes", size,
               UNKNOWNS);
  return false;
}

// Keypoints on cells of a surface; two residuals each, the second ones behind all first ones.
typedef struct {
  const double (*points)[3], (*jacobian)[POSE], *values, *weights;
  const float (*normals)[3];
  const int64_t *indices, *cells;  // of the keypoints that are on a cell, and the cells
  Py_ssize_t count, found, size;   // of keypoints, of those, and of all cells
  double smallest_cosine, weight;
} Keypoints;

// Return whether all indices are those of keypoints and of cells.
FOR_EACH_PROCESSOR
static bool add_keypoints(const Keypoints *keypoints, const Motion *motion, Equations *to) {
  double products[UNKNOWNS][UNKNOWNS] = {{0}};
  for (Py_ssize_t n = 0; n < keypoints->found; ++n) {
    const int64_t i = keypoints->indices[n], cell = keypoints->cells[n];
    if (i < 0 || i >= keypoints->count || cell < 0 || cell >= keypoints->size)
      return false;
    const float *of_cell = keypoints->normals[cell];
    const double normal[3] = {of_cell[0], of_cell[1], of_cell[2]};
    for (Py_ssize_t at = i; at < 2 * keypoints->count; at += keypoints->count) {
      Row row;
      row.weight = keypoints->weight * keypoints->weights[at];
      row.value = keypoints->values[at];
      keypoint_row(motion, keypoints->jacobian[at], keypoints->points[i], normal,
                   keypoints->smallest_cosine, row.derivatives);
      add_known(&row, products, to->gradient);
    }
  }
  add_products(products, to);
  return true;
}

PyObject *kernel_keypoint_equations(PyObject *module, PyObject *arguments) {
  PyObject *objects[13];
  Keypoints keypoints;
  if (!PyArg_ParseTuple(arguments, "OOOOOOOdOOOOdOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &objects[5], &objects[6], &keypoints.weight,
                        &objects[7], &objects[8], &objects[9], &objects[10],
                        &keypoints.smallest_cosine, &objects[11], &objects[12]))
    return NULL;
  const Py_ssize_t count = row_count(objects[0]), found = row_count(objects[1]);
  const Py_ssize_t cells = row_count(objects[3]), size = row_count(objects[12]);
  if (!is_size(size))
    return NULL;
  const Argument needed[] = {
      {"the points", objects[0], 'd', 3 * count, false},
      {"the indices", objects[1], 'q', found, false},
      {"the cells", objects[2], 'q', found, false},
      {"the normals", objects[3], 'f', 3 * cells, false},
      {"the jacobian", objects[4], 'd', 2 * POSE * count, false},
      {"the values", objects[5], 'd', 2 * count, false},
      {"the weights", objects[6], 'd', 2 * count, false},
      {"the pose", objects[7], 'd', 16, false},
      {"the twists", objects[8], 'd', 12, false},
      {"the camera of the source", objects[9], 'd', CAMERA, false},
      {"the camera of the target", objects[10], 'd', CAMERA, false},
      {"the information", objects[11], 'd', size * size, true},
      {"the gradient", objects[12], 'd', size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  keypoints.points = arrays.views[0].buf;
  keypoints.indices = arrays.views[1].buf;
  keypoints.cells = arrays.views[2].buf;
  keypoints.normals = arrays.views[3].buf;
  keypoints.jacobian = arrays.views[4].buf;
  keypoints.values = arrays.views[5].buf;
  keypoints.weights = arrays.views[6].buf;
  keypoints.count = count;
  keypoints.found = found;
  keypoints.size = cells;
  Equations equations = {size, arrays.views[11].buf, arrays.views[12].buf, NULL};
  Motion motion;
  open_motion(&arrays, &motion, 7);
  bool are_rows;
  Py_BEGIN_ALLOW_THREADS
  are_rows = add_keypoints(&keypoints, &motion, &equations);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_rows) {
    PyErr_SetString(PyExc_ValueError, "an index is not that of a point or of a cell");
    return NULL;
  }
  Py_RETURN_NONE;
}

// A grid of nodes over the image, and the distortion at them that is corrected, of both frames.
typedef struct {
  Py_ssize_t rows, columns;
  const double *distortions[2];
} Nodes;

// Return whether there are so many nodes; false, with a ValueError, otherwise.
static bool is_grid(Py_ssize_t rows, Py_ssize_t columns) {
  if (rows >= 2 && columns >= 2 && rows <= LONGEST && columns <= LONGEST)
    return true;
  PyErr_Format(PyExc_ValueError, "%zd rows and %zd columns of nodes: 2 to %zd are required", rows,
               columns, LONGEST);
  return false;
}

static double limited(double value, double most) {
  return value > 0.0 ? (value < most ? value : most) : 0.0;
}

// The nodes around a place, the columns and rows of nodes counted, and their weights.
static inline void find_nodes(const double *place, Py_ssize_t rows, Py_ssize_t columns,
                              int64_t *nodes, double *weights) {
  const double column = limited(place[0], (double)(columns - 1));
  const double row = limited(place[1], (double)(rows - 1));
  const Py_ssize_t left = column < (double)(columns - 2) ? (Py_ssize_t)column : columns - 2;
  const Py_ssize_t top = row < (double)(rows - 2) ? (Py_ssize_t)row : rows - 2;
  const double right = column - (double)left, down = row - (double)top;
  for (int i = 0; i < AROUND; ++i) {
    nodes[i] = (top + i / 2) * columns + left + i % 2;
    weights[i] = (i % 2 ? right : 1.0 - right) * (i / 2 ? down : 1.0 - down);
  }
}

// Where a camera sees points among its nodes, the columns and rows of nodes counted.
INLINE void find_places(const CameraModel *camera, const Nodes *nodes, const double *points,
                        int count, double (*places)[2]) {
  const double across = fmax(camera->width - 1.0, 1.0) / (double)(nodes->columns - 1);
  const double down = fmax(camera->height - 1.0, 1.0) / (double)(nodes->rows - 1);
  project(points, count, camera, *places);
  for (int n = 0; n < count; ++n) {
    places[n][0] /= across;
    places[n][1] /= down;
  }
}

FOR_EACH_PROCESSOR
static void find_all_nodes(const CameraModel *camera, const Nodes *grid, const double (*points)[3],
                           Py_ssize_t count, int64_t (*nodes)[AROUND],
                           double (*weights)[AROUND]) {
  for (Py_ssize_t first = 0; first < count; first += FOUR) {
    const int many = count - first < FOUR ? (int)(count - first) : FOUR;
    double places[FOUR][2];
    find_places(camera, grid, points[first], many, places);
    for (int n = 0; n < many; ++n)
      find_nodes(places[n], grid->rows, grid->columns, nodes[first + n], weights[first + n]);
  }
}

PyObject *kernel_nodes_around(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *camera_array, *node_array, *weight_array;
  Nodes grid = {0};
  if (!PyArg_ParseTuple(arguments, "OOnnOO", &point_array, &camera_array, &grid.rows,
                        &grid.columns, &node_array, &weight_array))
    return NULL;
  if (!is_grid(grid.rows, grid.columns))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the camera", camera_array, 'd', CAMERA, false},
      {"the nodes", node_array, 'q', AROUND * count, true},
      {"the weights", weight_array, 'd', AROUND * count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const CameraModel camera = camera_of(arrays.views[1].buf);
  Py_BEGIN_ALLOW_THREADS
  find_all_nodes(&camera, &grid, arrays.views[0].buf, count, arrays.views[2].buf,
                 arrays.views[3].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

// Residuals of depth, of which one of some number is used, and counts for all of them.
typedef struct {
  const double (*points)[3], (*directions)[3], (*jacobian)[POSE], *values, *weights;
  Py_ssize_t count, every;
} DepthResiduals;

// The derivatives of a residual by the distortion of a frame, and what of it is applied. Nodes
// that are around both points are only there once.
static inline void depth_nodes(const Nodes *nodes, int frame, const double *place, double along,
                               Row *row) {
  double weights[AROUND];
  int64_t around[AROUND];
  find_nodes(place, nodes->rows, nodes->columns, around, weights);
  const bool are_others = row->count == 0 || row->nodes[0] != around[0];
  const int first = are_others ? row->count : 0;
  for (int i = 0; i < AROUND; ++i) {
    const double derivative = along * weights[i];
    row->applied += derivative * nodes->distortions[frame][around[i]];
    row->nodes[first + i] = around[i];
    row->by_nodes[first + i] = are_others ? derivative : row->by_nodes[i] + derivative;
  }
  row->count = first + AROUND;
}

// The row of a residual, of a point of the source, and of its places in both frames.
static inline void depth_row(const DepthResiduals *of, Py_ssize_t n, const Motion *motion,
                             const Nodes *nodes, const double *point, const double *in_frame,
                             const double *in_other, Row *row) {
  const double *moved = of->points[n], *in_target = of->directions[n];
  double in_source[3], of_source[6], of_target[6], *derivatives = row->derivatives;
  to_source_axes(motion, in_target, in_source);
  by_twist(in_source, point, of_source);
  by_twist(in_target, moved, of_target);
  for (int i = 0; i < POSE; ++i) {
    derivatives[i] = of->jacobian[n][i];
    derivatives[POSE + i] = of_source[i] - of_target[i];
  }
  derivatives[12] =
      along_twist(of_source, motion->twists[0]) - along_twist(of_target, motion->twists[1]);
  derivatives[13] = derivatives[15] = derivatives[17] = 0.0;  // of the colour image
  derivatives[14] =
      by_readout(motion, 0, in_source, point) - by_readout(motion, 1, in_target, moved);
  derivatives[16] = by_focal_length(in_source, point) - by_focal_length(in_target, moved);
  // an error of the inverse depth moves a point p by -z p
  row->applied = 0.0;
  row->count = 0;
  depth_nodes(nodes, 0, in_frame, -point[2] * dot(in_source, point), row);
  depth_nodes(nodes, 1, in_other, moved[2] * dot(in_target, moved), row);
}

FOR_EACH_PROCESSOR
static void add_depth(const DepthResiduals *residuals, const Motion *motion, const Nodes *nodes,
                      Equations *to) {
  double products[UNKNOWNS][UNKNOWNS] = {{0}};
  const Py_ssize_t every = residuals->every;
  for (Py_ssize_t first = 0; first < residuals->count; first += FOUR * every) {
    double points[FOUR][3], moved[FOUR][3], places[2][FOUR][2];
    int count = 0;
    for (Py_ssize_t n = first; n < residuals->count && count < FOUR; n += every, ++count) {
      memcpy(moved[count], residuals->points[n], sizeof(moved[count]));
      to_source(motion, moved[count], points[count]);
    }
    find_places(&motion->cameras[0], nodes, *points, count, places[0]);
    find_places(&motion->cameras[1], nodes, *moved, count, places[1]);
    for (int k = 0; k < count; ++k) {
      const Py_ssize_t n = first + k * every;
      Row row;
      row.weight = (double)every * residuals->weights[n];
      row.value = residuals->values[n];
      depth_row(residuals, n, motion, nodes, points[k], places[0][k], places[1][k], &row);
      add_known(&row, products, to->gradient);
      add_nodes(&row, to);
    }
  }
  add_products(products, to);
  for (Py_ssize_t i = 0; i < UNKNOWNS; ++i)
    for (Py_ssize_t j = UNKNOWNS; j < to->size; ++j)
      to->information[to->size * i + j] = to->information[to->size * j + i];
}

PyObject *kernel_depth_equations(PyObject *module, PyObject *arguments) {
  PyObject *objects[13];
  Nodes nodes;
  Py_ssize_t every;
  if (!PyArg_ParseTuple(arguments, "OOOOOnOOOOnnOOOO", &objects[0], &objects[1], &objects[2],
                        &objects[3], &objects[4], &every, &objects[5], &objects[6], &objects[7],
                        &objects[8], &nodes.rows, &nodes.columns, &objects[9], &objects[10],
                        &objects[11], &objects[12]) ||
      !is_grid(nodes.rows, nodes.columns))
    return NULL;
  if (every < 1 || every > LONGEST) {
    PyErr_Format(PyExc_ValueError, "one of %zd residuals: one of 1 to %zd is required", every,
                 LONGEST);
    return NULL;
  }
  const Py_ssize_t count = row_count(objects[0]), all = nodes.rows * nodes.columns;
  const Py_ssize_t size = UNKNOWNS + all;
  if (!is_size(size))
    return NULL;
  const Argument needed[] = {
      {"the points", objects[0], 'd', 3 * count, false},
      {"the directions", objects[1], 'd', 3 * count, false},
      {"the jacobian", objects[2], 'd', POSE * count, false},
      {"the values", objects[3], 'd', count, false},
      {"the weights", objects[4], 'd', count, false},
      {"the pose", objects[5], 'd', 16, false},
      {"the twists", objects[6], 'd', 12, false},
      {"the camera of the source", objects[7], 'd', CAMERA, false},
      {"the camera of the target", objects[8], 'd', CAMERA, false},
      {"the distortion of the source", objects[9], 'd', all, false},
      {"the distortion of the target", objects[10], 'd', all, false},
      {"the information", objects[11], 'd', size * size, true},
      {"the gradients", objects[12], 'd', 2 * size, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const DepthResiduals residuals = {
      arrays.views[0].buf, arrays.views[1].buf, arrays.views[2].buf, arrays.views[3].buf,
      arrays.views[4].buf, count, every};
  nodes.distortions[0] = arrays.views[9].buf;
  nodes.distortions[1] = arrays.views[10].buf;
  double *gradients = arrays.views[12].buf;
  Equations equations = {size, arrays.views[11].buf, gradients, gradients + size};
  Motion motion;
  open_motion(&arrays, &motion, 5);
  Py_BEGIN_ALLOW_THREADS
  add_depth(&residuals, &motion, &nodes, &equations);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}
