// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Smaller images, by bilinear interpolation with weights of eight bits, as OpenCV's exact one.

#include <math.h>
#include <stdlib.h>

#include "arrays.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum {
  TWICE = 2 * EIGHT,  // pixels that are read at once, of which eight new ones are made
  ONE = 256,          // the sum of two weights
  HALF = 1 << 15,     // of the product of two such sums, which grey levels have as a factor
};

typedef uint8_t TwiceBytes __attribute__((vector_size(TWICE)));
typedef uint16_t TwiceShorts __attribute__((vector_size(TWICE * sizeof(uint16_t))));
typedef uint16_t Products __attribute__((vector_size(EIGHT * sizeof(uint16_t))));

// Which two pixels of a line a new one lies between, and the weight of the second one.
typedef struct {
  Py_ssize_t first, second;
  uint16_t weight;
} Between;

static Between between(Py_ssize_t index, Py_ssize_t count, Py_ssize_t new_count) {
  const double scale = 1.0 / ((double)new_count / (double)count);
  const double place = scale * ((double)index + 0.5) - 0.5, before = floor(place);
  if (before < 0.0)
    return (Between){0, 0, 0};
  if (before >= (double)(count - 1))
    return (Between){count - 1, count - 1, 0};
  return (Between){(Py_ssize_t)before, (Py_ssize_t)before + 1,
                   (uint16_t)rint((place - before) * ONE)};
}

// How eight new pixels of a row are made of those from the first one on.
typedef struct {
  Py_ssize_t first;
  bool is_near;           // whether these are within the pixels read at once, and in the row
  uint8_t places[TWICE];  // of the eight first ones, and of the eight second ones
  uint16_t weights[TWICE];
} Group;

static void set_group(Group *group, const Between *row, Py_ssize_t width) {
  group->first = row[0].first;
  group->is_near = group->first + TWICE <= width;
  for (int lane = 0; lane < EIGHT; ++lane) {
    const Py_ssize_t first = row[lane].first - group->first;
    const Py_ssize_t second = row[lane].second - group->first;
    group->is_near = group->is_near && second < TWICE;
    group->places[lane] = (uint8_t)first;
    group->places[EIGHT + lane] = (uint8_t)second;
    group->weights[lane] = (uint16_t)(ONE - row[lane].weight);
    group->weights[EIGHT + lane] = row[lane].weight;
  }
}

// A smaller image to be made, and what its rows are made by.
typedef struct {
  const uint8_t *pixels;
  uint8_t *smaller;
  Size size, new_size;
  Between *row;
  Group *groups;
  uint16_t *above, *below;  // rows of sums, and which ones of the image they are of
  Py_ssize_t above_row, below_row;
} Shrinking;

INLINE void add_eight(const uint8_t *pixels, const Group *group, uint16_t *sums) {
  TwiceBytes read, places;
  TwiceShorts weights;
  memcpy(&read, pixels + group->first, sizeof(read));
  memcpy(&places, group->places, sizeof(places));
  memcpy(&weights, group->weights, sizeof(weights));
  const TwiceBytes sorted = __builtin_shuffle(read, places);
  const TwiceShorts products = __builtin_convertvector(sorted, TwiceShorts) * weights;
  Products parts[2];
  memcpy(parts, &products, sizeof(parts));
  parts[0] += parts[1];
  memcpy(sums, parts, sizeof(parts[0]));
}

// The weighted sums of two neighbours each of a row.
INLINE void sum_row(const Shrinking *work, Py_ssize_t y, uint16_t *sums) {
  const uint8_t *pixels = work->pixels + y * work->size.width;
  const Py_ssize_t width = work->new_size.width;
  for (Py_ssize_t x = 0; x < width; x += EIGHT) {
    const Group *group = &work->groups[x / EIGHT];
    if (x + EIGHT <= width && group->is_near) {
      add_eight(pixels, group, sums + x);
      continue;
    }
    for (Py_ssize_t i = x; i < x + EIGHT && i < width; ++i) {
      const Between *here = &work->row[i];
      sums[i] = (uint16_t)(pixels[here->first] * (ONE - here->weight) +
                           pixels[here->second] * here->weight);
    }
  }
}

// Let the two rows of sums be those of two rows of the image.
INLINE void set_rows(Shrinking *work, Py_ssize_t above, Py_ssize_t below) {
  if (work->below_row == above) {
    uint16_t *spare = work->above;
    work->above = work->below;
    work->above_row = above;
    work->below = spare;
    work->below_row = -1;
  }
  if (work->above_row != above)
    sum_row(work, above, work->above);
  if (work->below_row != below)
    sum_row(work, below, work->below);
  work->above_row = above;
  work->below_row = below;
}

FOR_EACH_PROCESSOR
static void shrink(Shrinking *work) {
  const Py_ssize_t width = work->new_size.width;
  for (Py_ssize_t y = 0; y < work->new_size.height; ++y) {
    const Between rows = between(y, work->size.height, work->new_size.height);
    set_rows(work, rows.first, rows.second);
    const uint32_t weight = rows.weight;
    const uint16_t *restrict above = work->above, *restrict below = work->below;
    uint8_t *restrict smaller = work->smaller + y * width;
    for (Py_ssize_t x = 0; x < width; ++x)
      smaller[x] = (uint8_t)((above[x] * (ONE - weight) + below[x] * weight + HALF) >> 16);
  }
}

// Make what the rows are made by; false without memory for it.
static bool prepare(Shrinking *work) {
  const Py_ssize_t width = work->new_size.width, groups = (width + EIGHT - 1) / EIGHT;
  work->row = calloc((size_t)(groups * EIGHT), sizeof(*work->row));
  work->groups = calloc((size_t)groups, sizeof(*work->groups));
  work->above = calloc((size_t)width, sizeof(*work->above));
  work->below = calloc((size_t)width, sizeof(*work->below));
  work->above_row = work->below_row = -1;
  if (work->row == NULL || work->groups == NULL || work->above == NULL || work->below == NULL)
    return false;
  for (Py_ssize_t x = 0; x < width; ++x)
    work->row[x] = between(x, work->size.width, width);
  for (Py_ssize_t group = 0; group < groups; ++group)
    set_group(&work->groups[group], work->row + group * EIGHT, work->size.width);
  return true;
}

PyObject *kernel_shrink(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *smaller_array;
  if (!PyArg_ParseTuple(arguments, "OO", &image_array, &smaller_array))
    return NULL;
  const Argument needed[] = {
      {"the image", image_array, 'B', IMAGE, false},
      {"the smaller image", smaller_array, 'B', IMAGE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  Shrinking work = {.pixels = arrays.views[0].buf, .smaller = arrays.views[1].buf,
                    .size = size_of(&arrays.views[0]), .new_size = size_of(&arrays.views[1])};
  const bool is_smaller =
      work.new_size.width <= work.size.width && work.new_size.height <= work.size.height;
  bool is_made = false;
  if (!is_smaller) {
    PyErr_SetString(PyExc_ValueError, "the smaller image is larger than the image");
  } else if (prepare(&work)) {
    Py_BEGIN_ALLOW_THREADS
    shrink(&work);
    Py_END_ALLOW_THREADS
    is_made = true;
  } else {
    PyErr_NoMemory();
  }
  free(work.row);
  free(work.groups);
  free(work.above);
  free(work.below);
  close_arrays(&arrays);
  if (!is_made)
    return NULL;
  Py_RETURN_NONE;
}
