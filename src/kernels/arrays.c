// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "arrays.h"

#include <string.h>

static bool has_type(const Py_buffer *view, char type) {
  const char *format = view->format;
  if (format == NULL || strlen(format) != 1)
    return false;
  if (type == 'q')
    return view->itemsize == 8 && strchr("lqn", *format) != NULL;
  return *format == type;
}

static bool open_array(Py_buffer *view, const Argument *argument) {
  const int flags =
      PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (argument->is_written ? PyBUF_WRITABLE : 0);
  if (PyObject_GetBuffer(argument->object, view, flags) < 0)
    return false;
  if (!has_type(view, argument->type)) {
    PyErr_Format(PyExc_TypeError, "%s has numbers of type %s: %c is required", argument->name,
                 view->format, argument->type);
  } else if (argument->count == IMAGE && (view->ndim != 2 || view->len == 0)) {
    PyErr_Format(PyExc_ValueError, "%s has no rows and columns", argument->name);
  } else if (argument->count != IMAGE && view->len / view->itemsize != argument->count) {
    PyErr_Format(PyExc_ValueError, "%s has %zd numbers: %zd are required", argument->name,
                 view->len / view->itemsize, argument->count);
  } else {
    return true;
  }
  PyBuffer_Release(view);
  return false;
}

bool open_arrays(Arrays *arrays, const Argument *arguments, int count) {
  if (PyErr_Occurred())  // an array without a length
    return false;
  for (arrays->count = 0; arrays->count < count; ++arrays->count) {
    if (!open_array(&arrays->views[arrays->count], &arguments[arrays->count])) {
      close_arrays(arrays);
      return false;
    }
  }
  return true;
}

void close_arrays(Arrays *arrays) {
  while (arrays->count > 0)
    PyBuffer_Release(&arrays->views[--arrays->count]);
}

Size size_of(const Py_buffer *image) { return (Size){image->shape[0], image->shape[1]}; }
