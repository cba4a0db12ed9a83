// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Depth at pixels.

#include "arrays.h"
#include "depth_image.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

FOR_EACH_PROCESSOR
static void sample_all(const DepthImage *image, const double (*pixels)[2], Py_ssize_t count,
                       const DepthRange *range, double *depths) {
  for (Py_ssize_t i = 0; i < count; ++i)
    fetch_depth(image, pixels[i]);
  for (Py_ssize_t i = 0; i < count; ++i)
    depths[i] = depth_at(image, pixels[i][0], pixels[i][1], range);
}

PyObject *kernel_sample_depth(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *pixel_array, *found_array;
  DepthImage image;
  DepthRange range;
  if (!PyArg_ParseTuple(arguments, "OOdddO", &image_array, &pixel_array, &range.jump,
                        &range.nearest, &range.farthest, &found_array))
    return NULL;
  const Py_ssize_t count = row_count(pixel_array);
  const Argument needed[] = {
      {"the image", image_array, 'f', IMAGE, false},
      {"the pixels", pixel_array, 'd', 2 * count, false},
      {"the depths", found_array, 'd', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  image.depths = arrays.views[0].buf;
  image.size = size_of(&arrays.views[0]);
  Py_BEGIN_ALLOW_THREADS
  sample_all(&image, arrays.views[1].buf, count, &range, arrays.views[2].buf);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

FOR_EACH_PROCESSOR
static void keep_valid(const float *restrict depths, Py_ssize_t count, float low, float high,
                       float *restrict valid) {
  for (Py_ssize_t i = 0; i < count; ++i)
    valid[i] = depths[i] >= low && depths[i] <= high ? depths[i] : NAN;
}

// Whether each depth is in a range or NaN.
FOR_EACH_PROCESSOR
static bool are_valid(const float *depths, Py_ssize_t count, float low, float high) {
  int32_t are_all = 1;
  for (Py_ssize_t i = 0; i < count; ++i)
    are_all &= ((depths[i] >= low) & (depths[i] <= high)) | (depths[i] != depths[i]);
  return are_all;
}

PyObject *kernel_is_valid_depth(PyObject *module, PyObject *arguments) {
  PyObject *image_array;
  double nearest, farthest;
  if (!PyArg_ParseTuple(arguments, "Odd", &image_array, &nearest, &farthest))
    return NULL;
  const Argument needed[] = {{"the depths", image_array, 'f', IMAGE, false}};
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[0]);
  bool is_valid;
  Py_BEGIN_ALLOW_THREADS
  is_valid = are_valid(arrays.views[0].buf, size.height * size.width, (float)nearest,
                       (float)farthest);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return PyBool_FromLong(is_valid);
}

PyObject *kernel_valid_depth(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *valid_array;
  double nearest, farthest;
  if (!PyArg_ParseTuple(arguments, "OddO", &image_array, &nearest, &farthest, &valid_array))
    return NULL;
  const Argument needed[] = {
      {"the image", image_array, 'f', IMAGE, false},
      {"the valid depths", valid_array, 'f', IMAGE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_ssize_t count = arrays.views[0].len / (Py_ssize_t)sizeof(float);
  const bool fits = arrays.views[1].len == arrays.views[0].len;
  if (fits) {
    Py_BEGIN_ALLOW_THREADS
    keep_valid(arrays.views[0].buf, count, (float)nearest, (float)farthest, arrays.views[1].buf);
    Py_END_ALLOW_THREADS
  } else {
    PyErr_SetString(PyExc_ValueError, "the images are not of the same size");
  }
  close_arrays(&arrays);
  if (!fits)
    return NULL;
  Py_RETURN_NONE;
}

// The depth in the middle, or of the nearest of four pixels around it where it has none.
INLINE float filled_at(float middle, float left, float right, float above, float below) {
  float nearest = INFINITY;
  nearest = left < nearest ? left : nearest;
  nearest = right < nearest ? right : nearest;
  nearest = above < nearest ? above : nearest;
  nearest = below < nearest ? below : nearest;
  const float known = nearest < INFINITY ? nearest : NAN;
  return middle == middle ? middle : known;
}

FOR_EACH_PROCESSOR
static void fill_row(const float *above, const float *middle, const float *below,
                     Py_ssize_t width, float *restrict filled) {
  const Py_ssize_t last = width - 1;
  filled[0] = filled_at(middle[0], middle[0], middle[last > 0], above[0], below[0]);
  for (Py_ssize_t i = 1; i < last; ++i)
    filled[i] = filled_at(middle[i], middle[i - 1], middle[i + 1], above[i], below[i]);
  filled[last] = filled_at(middle[last], middle[last > 0 ? last - 1 : 0], middle[last],
                           above[last], below[last]);
}

static void fill_all(const float *depths, Size size, float *filled) {
  for (Py_ssize_t row = 0; row < size.height; ++row) {
    const float *middle = depths + row * size.width;
    fill_row(row > 0 ? middle - size.width : middle, middle,
             row + 1 < size.height ? middle + size.width : middle, size.width,
             filled + row * size.width);
  }
}

PyObject *kernel_filled_depth(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *filled_array;
  if (!PyArg_ParseTuple(arguments, "OO", &image_array, &filled_array))
    return NULL;
  const Argument needed[] = {
      {"the image", image_array, 'f', IMAGE, false},
      {"the filled image", filled_array, 'f', IMAGE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Size size = size_of(&arrays.views[0]), to = size_of(&arrays.views[1]);
  const bool fits = size.width == to.width && size.height == to.height;
  if (fits) {
    Py_BEGIN_ALLOW_THREADS
    fill_all(arrays.views[0].buf, size, arrays.views[1].buf);
    Py_END_ALLOW_THREADS
  } else {
    PyErr_SetString(PyExc_ValueError, "the images are not of the same size");
  }
  close_arrays(&arrays);
  if (!fits)
    return NULL;
  Py_RETURN_NONE;
}

// Add to the inverse depths of neighbours in a row what is missing there, linear in the column.
FOR_EACH_PROCESSOR
static void undistort(const float *restrict depths, int count, float first, float slope,
                      float least, float *restrict undistorted) {
  for (int i = 0; i < count; ++i) {
    const float scale = 1.0f + depths[i] * (first + slope * (float)i);
    undistorted[i] = depths[i] / (scale > least ? scale : least);
  }
}

// What is missing is known at nodes, of which the first and last lie on the borders of the image.
typedef struct {
  const double *values;
  Size size;
} Nodes;

// The place of a pixel among the nodes along a side of the image, 0 at the first.
static double place_of(Py_ssize_t pixel, Py_ssize_t pixels, Py_ssize_t nodes) {
  return pixels > 1 ? (double)(pixel * (nodes - 1)) / (double)(pixels - 1) : 0.0;
}

static void undistort_row(const float *depths, Size size, const Nodes *nodes, Py_ssize_t row,
                          float least, float *undistorted) {
  const Py_ssize_t gaps = nodes->size.width - 1, lowest = nodes->size.height - 2;
  const double place = place_of(row, size.height, nodes->size.height);
  const Py_ssize_t upper = (Py_ssize_t)place < lowest ? (Py_ssize_t)place : lowest;
  const double *above = nodes->values + upper * nodes->size.width;
  const double *below = above + nodes->size.width;
  const double downwards = place - (double)upper;
  const double step = place_of(1, size.width, nodes->size.width);
  for (Py_ssize_t gap = 0, begin = 0, end; begin < size.width; ++gap, begin = end) {
    end = gap + 1 < gaps && size.width > 1 ? ((gap + 1) * (size.width - 1) + gaps - 1) / gaps
                                           : size.width;
    const double left = above[gap] + (below[gap] - above[gap]) * downwards;
    const double right = above[gap + 1] + (below[gap + 1] - above[gap + 1]) * downwards;
    const double across = place_of(begin, size.width, nodes->size.width) - (double)gap;
    undistort(depths + begin, (int)(end - begin), (float)(left + (right - left) * across),
              (float)((right - left) * step), least, undistorted + begin);
  }
}

PyObject *kernel_undistort_depth(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *node_array, *undistorted_array;
  float least;
  if (!PyArg_ParseTuple(arguments, "OOfO", &image_array, &node_array, &least,
                        &undistorted_array))
    return NULL;
  const Argument needed[] = {
      {"the image", image_array, 'f', IMAGE, false},
      {"the nodes", node_array, 'd', IMAGE, false},
      {"the undistorted image", undistorted_array, 'f', IMAGE, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Size size = size_of(&views[0]), undistorted = size_of(&views[2]);
  const Nodes nodes = {views[1].buf, size_of(&views[1])};
  const bool fits = size.width == undistorted.width && size.height == undistorted.height;
  const bool has_nodes = nodes.size.width > 1 && nodes.size.height > 1;
  if (fits && has_nodes) {
    Py_BEGIN_ALLOW_THREADS
    for (Py_ssize_t row = 0; row < size.height; ++row)
      undistort_row((const float *)views[0].buf + row * size.width, size, &nodes, row, least,
                    (float *)views[2].buf + row * size.width);
    Py_END_ALLOW_THREADS
  } else {
    PyErr_SetString(PyExc_ValueError, fits ? "there are less than 2 x 2 nodes"
                                           : "the images are not of the same size");
  }
  close_arrays(&arrays);
  if (!fits || !has_nodes)
    return NULL;
  Py_RETURN_NONE;
}
