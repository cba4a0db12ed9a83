// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "bordered.h"

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
