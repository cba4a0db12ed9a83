// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Descriptors of ORB: comparisons of pixels around a point, turned by its direction, in a blurred
// image.

#include <math.h>

#include "arrays.h"
#include "blurring.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum {
  WIDTH = 32,                // bytes of a descriptor
  BITS = EIGHT * WIDTH,      // each of which compares two pixels
  LARGEST_SQUARE = 1 << 20,  // of the distance of a pixel that is compared
  WIDEST = 1 << 20,          // of images: its product with the distance fits into 32 bits
};

// The coordinates of both pixels of each comparison, relative to the point.
typedef struct {
  float first_x[BITS], first_y[BITS], second_x[BITS], second_y[BITS];
} Pattern;

// Where eight pixels lie in memory, relative to the point.
INLINE void turn(const float *xs, const float *ys, float cosine, float sine, int32_t step,
                 int32_t *places) {
  const Floats x = load(xs), y = load(ys);
  const Integers column = rounded(x * cosine - y * sine), row = rounded(x * sine + y * cosine);
  const Integers place = row * step + column;
  memcpy(places, &place, sizeof(place));
}

FOR_EACH_PROCESSOR
static void describe(const Pixel *point, Py_ssize_t step, float direction, const Pattern *pattern,
                     uint8_t *descriptor) {
  const float angle = direction * (float)(3.14159265358979323846 / 180.0);
  const float cosine = (float)cos((double)angle), sine = (float)sin((double)angle);
  for (int byte = 0; byte < WIDTH; ++byte) {
    const int first = EIGHT * byte;
    int32_t ones[EIGHT], others[EIGHT];
    turn(pattern->first_x + first, pattern->first_y + first, cosine, sine, (int32_t)step, ones);
    turn(pattern->second_x + first, pattern->second_y + first, cosine, sine, (int32_t)step,
         others);
    unsigned bits = 0;
    for (int bit = 0; bit < EIGHT; ++bit)
      bits |= (unsigned)(point[ones[bit]] < point[others[bit]]) << bit;
    descriptor[byte] = (uint8_t)bits;
  }
}

static double square_of(float x, float y) {
  return (double)x * (double)x + (double)y * (double)y;
}

// The largest distance of a pixel from the point along an axis, in any direction of the point; one
// that is too large where coordinates are, or are not finite.
static Py_ssize_t reach_of(const Pattern *pattern) {
  double largest = 0.0;
  for (int i = 0; i < BITS; ++i) {
    const double first = square_of(pattern->first_x[i], pattern->first_y[i]);
    const double second = square_of(pattern->second_x[i], pattern->second_y[i]);
    if (!(first <= LARGEST_SQUARE && second <= LARGEST_SQUARE))
      return LONGEST;
    largest = fmax(largest, fmax(first, second));
  }
  return (Py_ssize_t)(sqrt(largest) + 0.51);  // as it is rounded, and a little more
}

// Whether points lie in an image and have directions.
static bool are_in(const Image *image, const float (*points)[2], const double *directions,
                   Py_ssize_t count) {
  bool is_in = image->step <= WIDEST;
  for (Py_ssize_t i = 0; i < count; ++i)
    is_in = is_in && points[i][0] >= 0.0f && points[i][0] <= (float)(image->width - 1) &&
            points[i][1] >= 0.0f && points[i][1] <= (float)(image->height - 1) &&
            fabs(directions[i]) <= 360.0;
  return is_in;
}

typedef struct {
  const Pattern *pattern;
  Py_ssize_t reach;
  const float (*points)[2];
  const double *directions;
  Py_ssize_t count;
  uint8_t (*descriptors)[WIDTH];
} Points;

// Blur an image around points, and describe them; false without memory for it.
static bool describe_all(const Image *image, Pixel *pixels, bool is_fused, const Points *work) {
  Blurring blurring;
  const bool has_memory = begin_blurring(&blurring, image, pixels);
  if (has_memory) {
    for (Py_ssize_t i = 0; i < work->count; ++i)
      need_around(&blurring, lrintf(work->points[i][0]), lrintf(work->points[i][1]), work->reach);
    blur(&blurring, is_fused);
    for (Py_ssize_t i = 0; i < work->count; ++i) {
      const Py_ssize_t x = lrintf(work->points[i][0]), y = lrintf(work->points[i][1]);
      describe(pixels + y * image->step + x, image->step, (float)work->directions[i],
               work->pattern, work->descriptors[i]);
    }
  }
  end_blurring(&blurring);
  return has_memory;
}

PyObject *kernel_describe_points(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *pattern_array, *point_array, *direction_array, *descriptor_array;
  Py_ssize_t border;
  int is_fused;
  if (!PyArg_ParseTuple(arguments, "OnOpOOO", &image_array, &border, &pattern_array, &is_fused,
                        &point_array, &direction_array, &descriptor_array))
    return NULL;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the image", image_array, 'B', IMAGE, true},
      {"the pattern", pattern_array, 'f', 4 * BITS, false},
      {"the points", point_array, 'f', 2 * count, false},
      {"the directions", direction_array, 'd', count, false},
      {"the descriptors", descriptor_array, 'B', count * WIDTH, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const Py_buffer *views = arrays.views;
  const Points work = {views[1].buf, reach_of(views[1].buf), views[2].buf,
                       views[3].buf, count,                  views[4].buf};
  Image image;
  bool is_made = false;
  if (set_image(&views[0], border, BLURRED_BORDER, &image)) {
    if (work.reach > border || !are_in(&image, work.points, work.directions, count)) {
      PyErr_SetString(PyExc_ValueError, "what is compared is not within the image and its border");
    } else {
      Pixel *pixels = (Pixel *)views[0].buf + border * image.step + border;
      Py_BEGIN_ALLOW_THREADS
      is_made = describe_all(&image, pixels, is_fused, &work);
      Py_END_ALLOW_THREADS
      if (!is_made)
        PyErr_NoMemory();
    }
  }
  close_arrays(&arrays);
  if (!is_made)
    return NULL;
  Py_RETURN_NONE;
}
