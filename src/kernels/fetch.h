// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// What is read next comes from the memory while something else is computed.

#ifndef AICK_ROS_FETCH_H
#define AICK_ROS_FETCH_H

#define PY_SSIZE_T_CLEAN
#include <Python.h>

enum { CACHE_LINE = 64 };  // bytes, of most processors

// Fetch rows that are some bytes long, and other bytes apart.
static inline void fetch_rows(const void *first, Py_ssize_t rows, Py_ssize_t length,
                              Py_ssize_t apart) {
  const char *row = first;
  for (Py_ssize_t i = 0; i < rows; ++i, row += apart) {
    for (Py_ssize_t at = 0; at < length; at += CACHE_LINE)
      __builtin_prefetch(row + at);
    __builtin_prefetch(row + length - 1);
  }
}

#endif
