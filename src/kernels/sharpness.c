// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// How much an image changes from pixel to pixel.

#include <stdint.h>

#include "bordered.h"
#include "kernels.h"
#include "processors.h"

enum { COLUMNS = 256 };  // chosen: the squares of as many are added up in 32 bits

typedef struct {
  int64_t laplacian, gradient;  // by the four neighbours, and by the 3x3 masks of Sobel
} Squares;

// Add the squares of the derivatives of some pixels of a row, at most COLUMNS.
FOR_EACH_PROCESSOR
static void add_row(const Pixel *restrict above, const Pixel *restrict row,
                    const Pixel *restrict below, Py_ssize_t count, Squares *sums) {
  int32_t laplacians = 0, gradients = 0;
  for (Py_ssize_t i = 0; i < count; ++i) {  // 16 bits hold a derivative, and are faster
    const int16_t laplacian = (int16_t)(above[i] + below[i] + row[i - 1] + row[i + 1] -
                                        4 * row[i]);
    const int16_t to_right = (int16_t)(above[i + 1] - above[i - 1] +
                                       2 * (row[i + 1] - row[i - 1]) +
                                       below[i + 1] - below[i - 1]);
    const int16_t downwards = (int16_t)(below[i - 1] - above[i - 1] +
                                        2 * (below[i] - above[i]) +
                                        below[i + 1] - above[i + 1]);
    laplacians += laplacian * laplacian;
    gradients += to_right * to_right;
    gradients += downwards * downwards;
  }
  sums->laplacian += laplacians;
  sums->gradient += gradients;
}

PyObject *kernel_derivative_squares(PyObject *module, PyObject *arguments) {
  PyObject *image_array;
  if (!PyArg_ParseTuple(arguments, "O", &image_array))
    return NULL;
  const Argument needed[] = {{"the image", image_array, 'B', IMAGE, false}};
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  Image image;
  Squares sums = {0, 0};
  const bool is_set = set_image(&arrays.views[0], 1, 1, &image);
  if (is_set) {
    Py_BEGIN_ALLOW_THREADS
    for (Py_ssize_t y = 0; y < image.height; ++y) {
      const Pixel *row = image.pixels + y * image.step;
      for (Py_ssize_t x = 0; x < image.width; x += COLUMNS) {
        const Py_ssize_t left = image.width - x;
        add_row(row - image.step + x, row + x, row + image.step + x,
                left < COLUMNS ? left : COLUMNS, &sums);
      }
    }
    Py_END_ALLOW_THREADS
  }
  close_arrays(&arrays);
  return is_set ? Py_BuildValue("LL", (long long)sums.laplacian, (long long)sums.gradient) : NULL;
}
