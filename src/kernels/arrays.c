// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "arrays.h"

#include <stdint.h>
#include <string.h>

Py_ssize_t row_count(PyObject *array) {
  if (PyErr_Occurred())
    return -1;
  const Py_ssize_t length = PyObject_Length(array);
  if (length <= LONGEST)
    return length;
  PyErr_Format(PyExc_ValueError, "an array of %zd rows is too long", length);
  return -1;
}

static bool has_type(const Py_buffer *view, char type) {
  const char *format = view->format;
  if (format == NULL || strlen(format) != 1)
    return false;
  if (type == 'q')
    return view->itemsize == 8 && strchr("lqn", *format) != NULL;
  return *format == type;
}

static bool is_floating(char type) { return type == 'd' || type == 'f'; }

// An array of NumPy, of a type that can have all of its numbers; it lets go of the one given.
static PyObject *of_type(PyObject *array, char type) {
  PyObject *convert = PyObject_GetAttrString(array, "astype");
  PyObject *arguments = Py_BuildValue("(C)", type);
  PyObject *options = Py_BuildValue("{s:s,s:O}", "casting", "safe", "copy", Py_False);
  PyObject *cast = convert != NULL && arguments != NULL && options != NULL
                       ? PyObject_Call(convert, arguments, options)
                       : NULL;
  Py_XDECREF(convert);
  Py_XDECREF(arguments);
  Py_XDECREF(options);
  Py_DECREF(array);
  return cast;
}

// The numbers of an argument in a contiguous array, floating-point ones of its type.
static PyObject *converted(const Argument *argument) {
  PyObject *numpy = PyImport_ImportModule("numpy");
  if (numpy == NULL)
    return NULL;
  PyObject *array = PyObject_CallMethod(numpy, "ascontiguousarray", "(O)", argument->object);
  Py_DECREF(numpy);
  return array != NULL && is_floating(argument->type) ? of_type(array, argument->type) : array;
}

// Begin the message of a TypeError with the name of the argument.
static void name_in_error(const char *name) {
  PyObject *type, *message, *trace;
  PyErr_Fetch(&type, &message, &trace);
  PyErr_NormalizeException(&type, &message, &trace);  // one without a message has none before
  PyErr_Format(PyExc_TypeError, "%s: %S", name, message);
  Py_XDECREF(type);
  Py_XDECREF(message);
  Py_XDECREF(trace);
}

// Open an array as it is; one that is read alone is converted where it must be.
static bool view_array(Py_buffer *view, const Argument *argument) {
  const int flags = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT;
  if (argument->is_written)
    return PyObject_GetBuffer(argument->object, view, flags | PyBUF_WRITABLE) == 0;
  if (PyObject_GetBuffer(argument->object, view, flags) == 0) {
    if (!is_floating(argument->type) || has_type(view, argument->type))
      return true;
    PyBuffer_Release(view);
  }
  PyErr_Clear();
  PyObject *array = converted(argument);
  const bool is_open = array != NULL && PyObject_GetBuffer(array, view, flags) == 0;
  Py_XDECREF(array);  // the view keeps it
  if (!is_open && PyErr_ExceptionMatches(PyExc_TypeError))
    name_in_error(argument->name);
  return is_open;
}

static bool open_array(Py_buffer *view, const Argument *argument) {
  if (argument->may_be_none && argument->object == Py_None) {
    *view = (Py_buffer){0};
    return true;
  }
  if (!view_array(view, argument))
    return false;
  if (!has_type(view, argument->type)) {
    PyErr_Format(PyExc_TypeError, "%s has numbers of type %s: %c is required", argument->name,
                 view->format, argument->type);
  } else if ((uintptr_t)view->buf % (size_t)view->itemsize) {
    PyErr_Format(PyExc_ValueError, "%s is not aligned", argument->name);
  } else if (argument->count == IMAGE && (view->ndim != 2 || view->len == 0)) {
    PyErr_Format(PyExc_ValueError, "%s has no rows and columns", argument->name);
  } else if (argument->count == IMAGE &&
             (view->shape[0] > LONGEST || view->shape[1] > LONGEST)) {
    PyErr_Format(PyExc_ValueError, "%s is too large", argument->name);
  } else if (argument->count != IMAGE && view->len / view->itemsize != argument->count) {
    PyErr_Format(PyExc_ValueError, "%s has %zd numbers: %zd are required", argument->name,
                 view->len / view->itemsize, argument->count);
  } else {
    return true;
  }
  PyBuffer_Release(view);
  return false;
}

static bool share_memory(const Py_buffer *one, const Py_buffer *other) {
  const uintptr_t a = (uintptr_t)one->buf, b = (uintptr_t)other->buf;
  return a < b + (size_t)other->len && b < a + (size_t)one->len;
}

// Whether the last opened array shares memory with an earlier one, and one of them is written.
static bool is_shared(const Arrays *arrays, const Argument *arguments) {
  const int last = arrays->count - 1;
  for (int i = 0; i < last; ++i) {
    if ((arguments[i].is_written || arguments[last].is_written) &&
        share_memory(&arrays->views[i], &arrays->views[last])) {
      PyErr_Format(PyExc_ValueError, "%s and %s share memory", arguments[i].name,
                   arguments[last].name);
      return true;
    }
  }
  return false;
}

bool open_arrays(Arrays *arrays, const Argument *arguments, int count) {
  if (PyErr_Occurred())  // an array without a length
    return false;
  for (arrays->count = 0; arrays->count < count;) {
    const bool is_open = open_array(&arrays->views[arrays->count], &arguments[arrays->count]);
    arrays->count += is_open;
    if (!is_open || is_shared(arrays, arguments)) {
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
