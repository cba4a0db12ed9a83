// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "bordered.h"

#include <string.h>

bool set_image(const Py_buffer *view, Py_ssize_t border, Py_ssize_t least, Image *image) {
  const Size size = size_of(view);
  if (border < least || border > size.height / 2 || border > size.width / 2) {
    PyErr_Format(PyExc_ValueError, "an image of %zd x %zd pixels has no border of %zd", size.width,
                 size.height, border);
    return false;
  }
  *image = (Image){(const Pixel *)view->buf + border * size.width + border,
                   size.height - 2 * border, size.width - 2 * border, size.width};
  return true;
}

// Outwards on both sides at once, so that an image narrower than its border is mirrored again.
static void mirror_row(Pixel *row, Py_ssize_t width, Py_ssize_t border) {
  Pixel *const last = row + width - 1;
  for (Py_ssize_t i = 1; i <= border; ++i) {
    row[-i] = row[i];
    last[i] = last[-i];
  }
}

void mirror(const Image *image, Pixel *pixels, Py_ssize_t border) {
  const Py_ssize_t step = image->step;
  for (Py_ssize_t y = 0; y < image->height; ++y)
    mirror_row(pixels + y * step, image->width, border);
  Pixel *const first = pixels - border, *const last = first + (image->height - 1) * step;
  for (Py_ssize_t i = 1; i <= border; ++i) {
    memcpy(first - i * step, first + i * step, (size_t)step);
    memcpy(last + i * step, last - i * step, (size_t)step);
  }
}
