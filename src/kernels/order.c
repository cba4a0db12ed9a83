// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Values at a place in their order.

#include "order.h"

#include <stdbool.h>

// Move the values that are below a pivot, or equal to it where that is wanted, in front of the
// others; return where these begin. No branch depends on a value: none would be foreseen.
static Py_ssize_t parted(double *values, Py_ssize_t first, Py_ssize_t end, double pivot,
                         bool with_equal) {
  Py_ssize_t begin = first;
  for (Py_ssize_t i = first; i < end; ++i) {
    const double value = values[i];
    values[i] = values[begin];
    values[begin] = value;
    begin += with_equal ? value <= pivot : value < pivot;
  }
  return begin;
}

double selected(double *values, Py_ssize_t count, Py_ssize_t index) {
  Py_ssize_t first = 0, end = count;
  while (end - first > 1) {
    const double pivot = values[first + (end - first) / 2];
    const Py_ssize_t others = parted(values, first, end, pivot, false);
    if (index < others) {
      end = others;
    } else if (others > first) {
      first = others;
    } else {  // the pivot is the least
      const Py_ssize_t above = parted(values, first, end, pivot, true);
      if (index < above || above == first)  // it is the pivot, or nothing compares with NaN
        break;
      first = above;
    }
  }
  return values[index];
}
