// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

#include "pairs.h"

#include <stdlib.h>
#include <string.h>

#include "processors.h"

// Change the size of an array; return false, and keep the array, where there is no memory.
static bool resize(int64_t **array, Py_ssize_t count) {
  int64_t *resized = realloc(*array, (size_t)count * sizeof(**array));
  if (resized != NULL)
    *array = resized;
  return resized != NULL;
}

// Make room for some more pairs; return false, and keep the list, where there is no memory.
static bool reserve(Pairs *pairs, Py_ssize_t more) {
  const Py_ssize_t needed = pairs->count + more;
  if (needed <= pairs->room)
    return true;
  const Py_ssize_t room = needed > 2 * pairs->room ? needed : 2 * pairs->room;
  if (!resize(&pairs->sources, room) || !resize(&pairs->targets, room))
    return false;
  pairs->room = room;
  return true;
}

enum { BLOCK = 16 };  // values that are compared at once, as few of them are below the bound

static inline int any_below(const float *values, float bound) {
  int below = 0;
#pragma GCC unroll 1  // else it is unrolled before it could be vectorised
  for (int j = 0; j < BLOCK; ++j)
    below |= values[j] < bound;
  return below;
}

FOR_EACH_PROCESSOR
bool add_below(Pairs *pairs, Py_ssize_t source, const float *values, Py_ssize_t count,
               float bound) {
  if (!reserve(pairs, count))
    return false;
  Py_ssize_t end = pairs->count;
  for (Py_ssize_t first = 0; first < count; first += BLOCK) {
    const Py_ssize_t last = first + BLOCK < count ? first + BLOCK : count;
    if (first + BLOCK <= count && !any_below(values + first, bound))
      continue;
    for (Py_ssize_t j = first; j < last; ++j) {
      if (values[j] < bound) {
        pairs->sources[end] = source;
        pairs->targets[end++] = j;
      }
    }
  }
  pairs->count = end;
  return true;
}

bool add_targets(Pairs *pairs, Py_ssize_t source, const int64_t *targets, Py_ssize_t count) {
  if (!reserve(pairs, count))
    return false;
  for (Py_ssize_t i = 0; i < count; ++i) {
    pairs->sources[pairs->count] = source;
    pairs->targets[pairs->count++] = targets[i];
  }
  return true;
}

static PyObject *as_bytes(const Pairs *pairs) {
  const Py_ssize_t size = pairs->count * (Py_ssize_t)sizeof(*pairs->sources);
  PyObject *rows = PyBytes_FromStringAndSize(NULL, 2 * size);
  if (rows != NULL && pairs->count > 0) {
    memcpy(PyBytes_AsString(rows), pairs->sources, (size_t)size);
    memcpy(PyBytes_AsString(rows) + size, pairs->targets, (size_t)size);
  }
  return rows;
}

PyObject *take_pairs(Pairs *pairs, bool is_complete) {
  PyObject *rows = is_complete ? as_bytes(pairs) : PyErr_NoMemory();
  free(pairs->sources);
  free(pairs->targets);
  *pairs = (Pairs){0};
  return rows;
}
