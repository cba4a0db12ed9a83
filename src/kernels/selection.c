// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Selection of keypoints that are spread over the cells of a grid.

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "arrays.h"
#include "kernels.h"

enum { MOST_ALONG = 2048 };  // cells in a row or column; pixels farther out share the last ones

// The number of a cell along an axis.
static Py_ssize_t cell_along(double place, double size) {
  return (Py_ssize_t)fmin(fmax(floor(place / size), 0.0), MOST_ALONG - 1);
}

typedef struct {
  double size;
  Py_ssize_t columns, rows;
} Grid;

// Return the grid that holds all pixels.
static Grid grid_of(const double (*pixels)[2], Py_ssize_t count, double size) {
  double right = 0.0, bottom = 0.0;
  for (Py_ssize_t i = 0; i < count; ++i) {
    right = fmax(right, pixels[i][0]);
    bottom = fmax(bottom, pixels[i][1]);
  }
  return (Grid){size, cell_along(right, size) + 1, cell_along(bottom, size) + 1};
}

static Py_ssize_t cell_of(const Grid *grid, const double *pixel) {
  return cell_along(pixel[1], grid->size) * grid->columns + cell_along(pixel[0], grid->size);
}

// Write the rank of each pixel among those of its cell; in_cell has a zero for each cell. Count
// the pixels of each rank.
static void find_ranks(const double (*pixels)[2], Py_ssize_t count, const Grid *grid,
                       Py_ssize_t *in_cell, Py_ssize_t *ranks, Py_ssize_t *of_rank) {
  for (Py_ssize_t i = 0; i < count; ++i) {
    ranks[i] = in_cell[cell_of(grid, pixels[i])]++;
    ++of_rank[ranks[i]];
  }
}

// Write the first pixels in the order of their ranks, sorted again; return their number.
static Py_ssize_t choose(const Py_ssize_t *ranks, const Py_ssize_t *of_rank, Py_ssize_t count,
                         Py_ssize_t wanted, int64_t *chosen) {
  Py_ssize_t rank = 0, left = wanted < count ? wanted : count, found = 0;
  while (rank < count && left >= of_rank[rank])
    left -= of_rank[rank++];
  for (Py_ssize_t i = 0; i < count; ++i)
    if (ranks[i] < rank || (ranks[i] == rank && left-- > 0))
      chosen[found++] = i;
  return found;
}

PyObject *kernel_spread(PyObject *module, PyObject *arguments) {
  PyObject *pixel_array, *chosen_array;
  double cell_size;
  if (!PyArg_ParseTuple(arguments, "OdO", &pixel_array, &cell_size, &chosen_array))
    return NULL;
  if (!(cell_size > 0.0)) {
    PyErr_SetString(PyExc_ValueError, "the size of the cells is not above 0");
    return NULL;
  }
  const Py_ssize_t count = row_count(pixel_array), wanted = row_count(chosen_array);
  const Argument needed[] = {
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the chosen", chosen_array, 'q', wanted, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const double(*pixels)[2] = arrays.views[0].buf;
  const Grid grid = grid_of(pixels, count, cell_size);
  const size_t cells = (size_t)(grid.columns * grid.rows);
  Py_ssize_t *numbers = calloc(cells + 2 * (size_t)count + 1, sizeof(*numbers)), found = 0;
  const bool is_made = numbers != NULL;
  if (is_made) {
    Py_ssize_t *ranks = numbers + cells, *of_rank = ranks + count;
    find_ranks(pixels, count, &grid, numbers, ranks, of_rank);
    found = choose(ranks, of_rank, count, wanted, arrays.views[1].buf);
  }
  free(numbers);
  close_arrays(&arrays);
  return is_made ? PyLong_FromSsize_t(found) : PyErr_NoMemory();
}
