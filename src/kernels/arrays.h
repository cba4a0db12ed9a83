// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Arrays as arguments of the kernels, by the buffer protocol.

#ifndef AICK_ROS_ARRAYS_H
#define AICK_ROS_ARRAYS_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <limits.h>
#include <stdbool.h>

enum {
  MOST_ARRAYS = 21,
  IMAGE = INT_MIN,  // a count: any, in rows and columns
};

// The largest length of an array, and side of an image: products of two, times three, fit into
// Py_ssize_t.
#define LONGEST ((Py_ssize_t)1 << 30)

// A contiguous array that a kernel reads or writes. One that is read alone is copied where it is
// not contiguous, and converted where the type can have all of its numbers.
typedef struct {
  const char *name;
  PyObject *object;
  char type;         // of its numbers, as in the struct module: d f B ?, q for all of 8 bytes
  Py_ssize_t count;  // numbers that it must have, or IMAGE
  bool is_written;
  bool may_be_none;  // its buffer is NULL then
} Argument;

// Opened arrays, in the order of the arguments.
typedef struct {
  Py_buffer views[MOST_ARRAYS];
  int count;
} Arrays;

// The number of rows of an array; -1, with an exception, where it has none or too many, and where
// there is an exception already.
Py_ssize_t row_count(PyObject *array);

// Open arrays; where one does not fit, set a TypeError or ValueError, open none, return false.
// Those that are written share memory with none of the others.
bool open_arrays(Arrays *arrays, const Argument *arguments, int count);

void close_arrays(Arrays *arrays);

typedef struct {
  Py_ssize_t height, width;
} Size;

// The size of an opened array that is an image.
Size size_of(const Py_buffer *image);

#define COUNT(arguments) ((int)(sizeof(arguments) / sizeof((arguments)[0])))

#endif
