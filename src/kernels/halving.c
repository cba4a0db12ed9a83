// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Images of half the resolution (Burt and Adelson 1983), as OpenCV's pyrDown makes them.

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "arrays.h"
#include "bordered.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum {
  TAPS = 5,          // of the binomial filter along rows and columns: 1 4 6 4 1
  REACH = TAPS / 2,  // pixels beside one that it reads
  HALF = 1 << 7,     // of the sum of all weights, to round
  FIRST = __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__ ? 8 : 0,  // bits of two below the first
};

// Two neighbours of a row, read at once: lanes of both need not be sorted.
typedef uint16_t Two;

INLINE Two two_at(const Pixel *pixels) {
  Two two;
  memcpy(&two, pixels, sizeof(two));
  return two;
}

INLINE int first_of(Two two) { return two >> FIRST & UINT8_MAX; }

INLINE int second_of(Two two) { return two >> (8 - FIRST) & UINT8_MAX; }

// Filter every second pixel of a row.
FOR_EACH_PROCESSOR
static void filter_row(const Pixel *restrict row, Py_ssize_t width, uint16_t *restrict sums) {
  for (Py_ssize_t x = 0; x < width; ++x) {
    const Two before = two_at(row + 2 * x - 2), here = two_at(row + 2 * x);
    const Two after = two_at(row + 2 * x + 2);
    sums[x] = (uint16_t)(first_of(before) + 4 * (second_of(before) + second_of(here)) +
                         6 * first_of(here) + first_of(after));
  }
}

// Filter along the columns of five rows of sums.
FOR_EACH_PROCESSOR
static void filter_columns(uint16_t *const *sums, Py_ssize_t width, Pixel *restrict smaller) {
  const uint16_t *restrict a = sums[0], *restrict b = sums[1], *restrict c = sums[2];
  const uint16_t *restrict d = sums[3], *restrict e = sums[4];
  for (Py_ssize_t x = 0; x < width; ++x)
    smaller[x] = (Pixel)((uint16_t)(a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x] + HALF) >> 8);
}

// Write the inside of a smaller image; sums have room for five of its rows.
static void halve(const Image *image, const Image *smaller, Pixel *pixels, uint16_t *sums) {
  uint16_t *rows[TAPS];
  Py_ssize_t next = -REACH;  // the first row that is not filtered yet
  for (Py_ssize_t y = 0; y < smaller->height; ++y) {
    for (; next <= 2 * y + REACH; ++next)
      filter_row(image->pixels + next * image->step, smaller->width,
                 sums + (next + REACH) % TAPS * smaller->width);
    for (int tap = 0; tap < TAPS; ++tap)
      rows[tap] = sums + (2 * y + tap) % TAPS * smaller->width;
    filter_columns(rows, smaller->width, pixels + y * smaller->step);
  }
}

PyObject *kernel_halve(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *smaller_array;
  Py_ssize_t border;
  if (!PyArg_ParseTuple(arguments, "OnO", &image_array, &border, &smaller_array))
    return NULL;
  const Argument needed[] = {
      {"the image", image_array, 'B', IMAGE, false},
      {"the smaller image", smaller_array, 'B', IMAGE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  Image image, smaller;
  uint16_t *sums = NULL;
  if (set_image(&arrays.views[0], border, REACH, &image) &&
      set_image(&arrays.views[1], border, REACH, &smaller)) {
    if (smaller.width != (image.width + 1) / 2 || smaller.height != (image.height + 1) / 2 ||
        smaller.width < 2 || smaller.height < 2)
      PyErr_SetString(PyExc_ValueError, "the smaller image is not half as large, or has no rows "
                                        "and columns to mirror");
    else if ((sums = malloc((size_t)(TAPS * smaller.width) * sizeof(*sums))) == NULL)
      PyErr_NoMemory();
  }
  const bool is_made = sums != NULL;
  if (is_made) {
    Pixel *pixels = (Pixel *)arrays.views[1].buf + border * smaller.step + border;
    Py_BEGIN_ALLOW_THREADS
    halve(&image, &smaller, pixels, sums);
    mirror(&smaller, pixels, border);
    Py_END_ALLOW_THREADS
  }
  free(sums);
  close_arrays(&arrays);
  if (!is_made)
    return NULL;
  Py_RETURN_NONE;
}
