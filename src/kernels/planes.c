// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Points of one surface and the planes of another one, whose cells they project to.

#include <math.h>
#include <stdint.h>

#include "arrays.h"
#include "blocks.h"
#include "cholesky.h"
#include "displacement.h"
#include "equations.h"
#include "kernels.h"
#include "processors.h"
#include "se3.h"
#include "sensor.h"
#include "weights.h"

// The surface of the target, on a grid of cells.
typedef struct {
  const float (*points)[3], (*normals)[3], *roughness;
  const char *usable;
  const double *intrinsics;  // fx fy cx cy
  Py_ssize_t width, height;
} Cells;

// Return whether a grid has such a size; false, with a ValueError, otherwise.
static bool is_size(Py_ssize_t width, Py_ssize_t height) {
  if (width >= 0 && height >= 0 && width <= LONGEST && height <= LONGEST)
    return true;
  PyErr_Format(PyExc_ValueError, "%zd x %zd is not the size of a grid", width, height);
  return false;
}

// The usable cell at a column and a row, of a point at a distance; -1 where there is none.
static inline Py_ssize_t cell_at(const Cells *cells, double z, double column, double row) {
  if (!(z > 0.0 && column >= 0.0 && column < (double)cells->width && row >= 0.0 &&
        row < (double)cells->height))
    return -1;
  const Py_ssize_t cell = (Py_ssize_t)row * cells->width + (Py_ssize_t)column;
  return cells->usable[cell] ? cell : -1;
}

PyObject *kernel_cells_at(PyObject *module, PyObject *arguments) {
  PyObject *point_array, *usable_array, *intrinsics_array, *index_array, *cell_array;
  Cells cells = {0};
  if (!PyArg_ParseTuple(arguments, "OOnnOOO", &point_array, &usable_array, &cells.width,
                        &cells.height, &intrinsics_array, &index_array, &cell_array) ||
      !is_size(cells.width, cells.height))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the points", point_array, 'd', 3 * count, false},
      {"the usable cells", usable_array, '?', cells.width * cells.height, false},
      {"the intrinsics", intrinsics_array, 'd', 4, false},
      {"the indices", index_array, 'q', count, true},
      {"the cells", cell_array, 'q', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double(*points)[3] = arrays.views[0].buf;
  cells.usable = arrays.views[1].buf;
  const double *camera = arrays.views[2].buf;
  int64_t *indices = arrays.views[3].buf, *numbers = arrays.views[4].buf;
  Py_ssize_t found = 0;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < count; ++i) {
    const double x = points[i][0], y = points[i][1], z = points[i][2];
    const Py_ssize_t cell = cell_at(&cells, z, rint(x / z * camera[0] + camera[2]),
                                    rint(y / z * camera[1] + camera[3]));
    if (cell >= 0) {
      indices[found] = i;
      numbers[found++] = cell;
    }
  }
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyLong_FromSsize_t(found);
}

// Points of the source that are sought in the target.
typedef struct {
  const float (*points)[3], (*normals)[3], *roughness;
  const int64_t *chosen;
  Py_ssize_t all, count;     // of the points, and of those chosen
  Displacement moves;        // of the source
  Displacement back;         // the one that undoes that of the target
  double focal;              // focal length of both depth images by that of the camera
} Sought;

typedef struct {
  const double *pose;  // 4x4
  const DepthNoise *noise;
  double reach, smallest_cosine;
} Pairing;

// Pairs of a point and a plane, a row for each.
typedef struct {
  double *values, (*jacobian)[6], (*points)[3], (*directions)[3];
  int64_t *blocks;
  Py_ssize_t count;
  double (*information)[6], (*noise)[6];  // sums over them
} Pairs;

// Points of the source side by side, and the cells that they may be paired with.
typedef struct {
  Column arms[3], points[3], rays[2];  // turned by the pose; as the target sees them
  Column normals[3], roughness;        // of the source, the normals turned by the pose
  Column planes[3], plane_normals[3], plane_roughness;
  Py_ssize_t cells[BATCH];  // -1: none
} Candidates;

// What the candidates give.
typedef struct {
  Column values, jacobian[6], others[6];  // two measurements of the Jacobian
  int64_t are_pairs[BATCH];
} Residuals;

static inline void turn(const double *pose, Column *vectors, Column *turned) {
  for (int i = 0; i < 3; ++i) {
    const double x = pose[4 * i], y = pose[4 * i + 1], z = pose[4 * i + 2];
    for (int n = 0; n < BATCH; ++n)
      turned[i][n] = x * vectors[0][n] + y * vectors[1][n] + z * vectors[2][n];
  }
}

// Move points of the source into the target, those of the surface with their precision.
static inline void move(const Sought *source, const double *pose, const int64_t *chosen, int count,
                        Candidates *to) {
  Column seen[3], moved[3], normals[3];
  for (int n = 0; n < BATCH; ++n) {
    const int64_t cell = chosen[n < count ? n : 0];
    for (int i = 0; i < 3; ++i) {
      seen[i][n] = source->points[cell][i];
      normals[i][n] = source->normals[cell][i];
    }
    to->roughness[n] = source->roughness[cell];
  }
  widen(seen, 1.0 / source->focal);
  displace(&source->moves, seen, moved);
  for (int i = 0; i < 3; ++i)
    for (int n = 0; n < BATCH; ++n)
      moved[i][n] = (float)moved[i][n];
  turn(pose, moved, to->arms);
  turn(pose, normals, to->normals);
  for (int i = 0; i < 3; ++i) {
    const double shift = pose[4 * i + 3];
    for (int n = 0; n < BATCH; ++n)
      moved[i][n] = to->arms[i][n] + shift;
  }
  displace(&source->back, moved, to->points);
  widen(to->points, source->focal);
}

// The cell that is read for a candidate: any, where it has none.
static inline Py_ssize_t cell_read(const Candidates *of, int n) {
  return of->cells[n] < 0 ? 0 : of->cells[n];
}

// Find the cells that points project to, and let them come from the memory.
static inline void find_cells(const Cells *cells, int count, Candidates *to) {
  Column places[2];
  for (int i = 0; i < 2; ++i) {
    const double scale = cells->intrinsics[i], centre = cells->intrinsics[2 + i];
    for (int n = 0; n < BATCH; ++n) {
      to->rays[i][n] = to->points[i][n] / to->points[2][n];
      places[i][n] = rint(to->rays[i][n] * scale + centre);
    }
  }
  for (int n = 0; n < BATCH; ++n) {
    to->cells[n] = n < count ? cell_at(cells, to->points[2][n], places[0][n], places[1][n]) : -1;
    const Py_ssize_t cell = cell_read(to, n);
    __builtin_prefetch(cells->points[cell]);
    __builtin_prefetch(cells->normals[cell]);
    __builtin_prefetch(cells->roughness + cell);
  }
}

// Look up these cells.
static inline void look_up(const Cells *cells, Candidates *to) {
  for (int n = 0; n < BATCH; ++n) {
    const Py_ssize_t cell = cell_read(to, n);
    for (int i = 0; i < 3; ++i) {
      to->planes[i][n] = cells->points[cell][i];
      to->plane_normals[i][n] = cells->normals[cell][i];
    }
    to->plane_roughness[n] = cells->roughness[cell];
  }
}

// The standard deviations of the inverse depths of points.
static inline void find_noise(const Pairing *pairing, const double *depths, Column noise) {
  const DepthNoise of_depth = *pairing->noise;
  for (int n = 0; n < BATCH; ++n)
    noise[n] = inverse_depth_sigma(depths[n], of_depth);
}

// The derivatives of moved points along directions, by the error of the pose.
static inline void derive(Column *directions, Column *arms, Column *jacobian) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    for (int n = 0; n < BATCH; ++n) {
      jacobian[i][n] = directions[i][n];
      jacobian[3 + i][n] = arms[j][n] * directions[k][n] - arms[k][n] * directions[j][n];
    }
  }
}

static inline void compare(Candidates *of, const Pairing *pairing, Residuals *found) {
  const double reach = pairing->reach, smallest_cosine = pairing->smallest_cosine;
  Column noise, directions[3], turned[3];
  find_noise(pairing, of->points[2], noise);
  for (int n = 0; n < BATCH; ++n) {
    const double x = of->points[0][n], y = of->points[1][n], z = of->points[2][n];
    const double a = of->plane_normals[0][n], b = of->plane_normals[1][n];
    const double c = of->plane_normals[2][n];
    const double distance = (x - of->planes[0][n]) * a + (y - of->planes[1][n]) * b +
                            (z - of->planes[2][n]) * c;
    const double cosine = of->normals[0][n] * a + of->normals[1][n] * b + of->normals[2][n] * c;
    const double relief = (of->plane_roughness[n] * of->plane_roughness[n] +
                           of->roughness[n] * of->roughness[n]) / 2.0;
    // an error sigma of inverse depth moves a point p by sigma z p
    const double root = 1.0 / (sqrt(noise[n] * noise[n] + relief) * z * (x * a + y * b + z * c));
    found->are_pairs[n] =
        (of->cells[n] >= 0) & (fabs(distance) < reach) & (cosine > smallest_cosine);
    found->values[n] = distance * root;
    for (int i = 0; i < 3; ++i) {
      directions[i][n] = of->plane_normals[i][n] * root;
      turned[i][n] = of->normals[i][n] * root;
    }
  }
  derive(directions, of->arms, found->jacobian);
  derive(turned, of->arms, found->others);
}

// Append the pairs; return how many they are, with the differences of their measurements.
static inline int append(const Candidates *of, const Residuals *found, Pairs *to,
                         double (*differences)[6]) {
  int count = 0;
  for (int n = 0; n < BATCH; ++n) {
    if (!found->are_pairs[n])
      continue;
    const Py_ssize_t row = to->count++;
    to->values[row] = found->values[n];
    to->blocks[row] = block_at(of->rays[0][n], of->rays[1][n]);
    for (int i = 0; i < 3; ++i) {
      to->points[row][i] = of->points[i][n];
      to->directions[row][i] = found->jacobian[i][n];
    }
    for (int i = 0; i < 6; ++i) {
      to->jacobian[row][i] = found->jacobian[i][n];
      differences[count][i] = found->jacobian[i][n] - found->others[i][n];
    }
    ++count;
  }
  return count;
}

// Add the products of rows with themselves, times a factor.
static inline void add_rows(double (*rows)[6], int count, double factor, double (*sums)[6]) {
  Products products = {0};
  for (int n = 0; n < count; ++n)
    add_row(rows[n], 0.0, 1.0, &products);
  add_squares(&products, factor, *sums);
}

// Return whether all numbers are those of points of the source.
static bool are_points(const Sought *source) {
  for (Py_ssize_t i = 0; i < source->count; ++i)
    if (source->chosen[i] < 0 || source->chosen[i] >= source->all)
      return false;
  return true;
}

// Seek a batch of points in the target, from one on; there may be none left.
static inline void seek(const Sought *source, const Cells *cells, const double *pose,
                        Py_ssize_t first, Candidates *to) {
  if (first >= source->count)
    return;
  const int count = source->count - first < BATCH ? (int)(source->count - first) : BATCH;
  move(source, pose, source->chosen + first, count, to);
  find_cells(cells, count, to);
}

FOR_EACH_PROCESSOR
static void find_pairs(const Sought *source, const Cells *cells, const Pairing *pairing,
                       Pairs *pairs) {
  Candidates buffers[2];  // those of a batch, and the next ones, whose cells are on their way
  seek(source, cells, pairing->pose, 0, &buffers[0]);
  for (Py_ssize_t first = 0; first < source->count; first += BATCH) {
    Candidates *candidates = &buffers[first / BATCH % 2];
    Residuals found;
    double differences[BATCH][6];
    seek(source, cells, pairing->pose, first + BATCH, &buffers[(first / BATCH + 1) % 2]);
    look_up(cells, candidates);
    compare(candidates, pairing, &found);
    const int added = append(candidates, &found, pairs, differences);
    add_rows(pairs->jacobian + pairs->count - added, added, 1.0, pairs->information);
    add_rows(differences, added, 0.5, pairs->noise);
  }
}

// The motion of the same constant twist over a multiple of the time.
static void scale_motion(const double *motion, double rate, double *scaled) {
  double twist[6];
  log_pose(motion, twist);
  for (int i = 0; i < 6; ++i)
    twist[i] *= rate;
  exp_pose(twist, scaled);
}

// The residuals of a pose whose error acts on them multiplied by a rate.
static void scale_rows(Pairs *pairs, double rate) {
  for (Py_ssize_t n = 0; n < pairs->count; ++n)
    for (int i = 0; i < 6; ++i)
      pairs->jacobian[n][i] *= rate;
}

// Whether noise has less than a share of the information about each direction, with a ridge added.
static bool are_observed(const Pairs *pairs, double share, double ridge) {
  double rest[6][6];
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      rest[i][j] = share * (pairs->information[i][j] + (i == j ? ridge : 0.0)) -
                   pairs->noise[i][j];
  return factorize(*rest, 6);
}

PyObject *kernel_point_to_plane(PyObject *module, PyObject *arguments) {
  PyObject *objects[21];
  Cells cells = {0};
  double rate, share, ridge;
  Pairing pairing = {0};
  Sought source = {0};
  if (!PyArg_ParseTuple(arguments, "OOOOOdOdOddOOOOnnOOOddddOOOOOOO", &objects[0],
                        &objects[1], &objects[2], &objects[3], &objects[4], &source.moves.height,
                        &objects[5], &rate, &objects[6], &source.back.height, &source.focal,
                        &objects[7], &objects[8], &objects[9], &objects[10], &cells.width,
                        &cells.height, &objects[11], &objects[12], &objects[13], &pairing.reach,
                        &pairing.smallest_cosine, &share, &ridge, &objects[14], &objects[15],
                        &objects[16], &objects[17], &objects[18], &objects[19], &objects[20]) ||
      !is_size(cells.width, cells.height))
    return NULL;
  source.all = row_count(objects[0]);
  source.count = row_count(objects[1]);
  const Py_ssize_t all = source.all, count = source.count;
  const Py_ssize_t size = cells.width * cells.height;
  const Argument needed[] = {
      {"the points of the source", objects[0], 'f', 3 * all, false},
      {"the chosen cells", objects[1], 'q', count, false},
      {"the normals of the source", objects[2], 'f', 3 * all, false},
      {"the roughness of the source", objects[3], 'f', all, false},
      {"the twists of the source", objects[4], 'd', 18, false},
      {"the pose", objects[5], 'd', 16, false},
      {"the twists of the target", objects[6], 'd', 18, false},
      {"the points of the target", objects[7], 'f', 3 * size, false},
      {"the normals of the target", objects[8], 'f', 3 * size, false},
      {"the usable cells", objects[9], '?', size, false},
      {"the roughness of the target", objects[10], 'f', size, false},
      {"the intrinsics", objects[11], 'd', 4, false},
      {"the noise of depth", objects[12], 'd', 2, false},
      {"the robustness", objects[13], 'd', 3, false},
      {"the values", objects[14], 'd', count, true},
      {"the jacobian", objects[15], 'd', 6 * count, true},
      {"the weights", objects[16], 'd', count, true},
      {"the points", objects[17], 'd', 3 * count, true},
      {"the directions", objects[18], 'd', 3 * count, true},
      {"the blocks", objects[19], 'q', count, true},
      {"the sums", objects[20], 'd', 72, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  source.points = arrays.views[0].buf;
  source.chosen = arrays.views[1].buf;
  source.normals = arrays.views[2].buf;
  source.roughness = arrays.views[3].buf;
  source.moves.constant = arrays.views[4].buf;
  source.moves.by_row = source.moves.constant + 12;  // behind the rows of colour
  double scaled[16];
  pairing.pose = arrays.views[5].buf;
  if (rate != 1.0) {
    scale_motion(pairing.pose, rate, scaled);
    pairing.pose = scaled;
  }
  double undone[18];
  for (int i = 0; i < 18; ++i)
    undone[i] = -((const double *)arrays.views[6].buf)[i];
  source.back.constant = undone;
  source.back.by_row = undone + 12;
  cells.points = arrays.views[7].buf;
  cells.normals = arrays.views[8].buf;
  cells.usable = arrays.views[9].buf;
  cells.roughness = arrays.views[10].buf;
  cells.intrinsics = arrays.views[11].buf;
  pairing.noise = arrays.views[12].buf;
  Pairs pairs = {arrays.views[14].buf, arrays.views[15].buf, arrays.views[17].buf,
                 arrays.views[18].buf, arrays.views[19].buf, 0,
                 arrays.views[20].buf, (double(*)[6])arrays.views[20].buf + 6};
  bool are_cells, is_observed;
  Py_BEGIN_ALLOW_THREADS
  are_cells = are_points(&source);
  if (are_cells && size > 0)
    find_pairs(&source, &cells, &pairing, &pairs);
  weigh(pairs.values, pairs.count, arrays.views[13].buf, arrays.views[16].buf);
  is_observed = are_observed(&pairs, share, ridge);
  if (rate != 1.0)
    scale_rows(&pairs, rate);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_cells) {
    PyErr_SetString(PyExc_ValueError, "a chosen cell is not one of the source");
    return NULL;
  }
  return Py_BuildValue("nO", pairs.count, is_observed ? Py_True : Py_False);
}
