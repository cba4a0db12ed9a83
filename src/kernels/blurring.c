// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// As OpenCV filters a part of an image: in single precision, first along the rows, from the left
// to the right, then along the columns, from the middle on.

#include "blurring.h"

#include <stdlib.h>
#include <string.h>

#include "lanes.h"
#include "processors.h"

enum {
  STRIP = 2 * EIGHT,  // columns
  RADIUS = 3,         // of the blur
  ROWS = 4,           // whose pixels are converted at once
  READ = 3 * EIGHT,   // pixels of a row that a strip of them depends on, in whole lanes
};

// Of a Gaussian with a standard deviation of 2 pixels.
static const float WEIGHTS[2 * RADIUS + 1] = {
    0.0701593235f, 0.131074876f, 0.190712824f, 0.216105938f,
    0.190712824f,  0.131074876f, 0.0701593235f,
};

INLINE Floats multiply_add(Floats factors, float weight, Floats sums, bool is_fused) {
  if (!is_fused)
    return factors * weight + sums;
  for (int lane = 0; lane < EIGHT; ++lane)
    sums[lane] = __builtin_fmaf(factors[lane], weight, sums[lane]);
  return sums;
}

// Wide integers are made of narrow ones all at once: not all that fuse have an instruction for it.
INLINE Floats load_levels(const Pixel *pixels) {
  return to_floats(__builtin_convertvector(load_pixels(pixels), Integers));
}

// The weighted sums of rows of a strip, from the leftmost pixels that they are of. All pixels are
// converted first: what has just been stored in lanes is not read at once in others.
INLINE void sum_rows(const Pixel *pixels, Py_ssize_t step, float *sums, bool is_fused) {
  float levels[ROWS][READ];
  for (int row = 0; row < ROWS; ++row)
    for (int i = 0; i < READ; i += EIGHT)
      store(load_levels(pixels + row * step + i), levels[row] + i);
  for (int row = 0; row < ROWS; ++row) {
    for (int column = 0; column < STRIP; column += EIGHT) {
      Floats sum = load(levels[row] + column) * WEIGHTS[0];
#pragma GCC unroll 6
      for (int i = 1; i <= 2 * RADIUS; ++i)
        sum = multiply_add(load(levels[row] + column + i), WEIGHTS[i], sum, is_fused);
      store(sum, sums + row * STRIP + column);
    }
  }
}

// The weighted sums of columns, for eight pixels of a row, as whole numbers.
INLINE Bytes sum_columns(const float *sums, bool is_fused) {
  Floats sum = load(sums) * WEIGHTS[RADIUS];
  for (int i = 1; i <= RADIUS; ++i)
    sum = multiply_add(load(sums + STRIP * i) + load(sums - STRIP * i), WEIGHTS[RADIUS + i], sum,
                       is_fused);
  return __builtin_convertvector(__builtin_convertvector(rounded(sum), Shorts), Bytes);
}

// The first row from one on that is needed, or the height.
INLINE Py_ssize_t next_needed(const uint8_t *needed, Py_ssize_t y, Py_ssize_t height) {
  if (y < height && needed[y])  // as most often: no call
    return y;
  const uint8_t *const found = memchr(needed + y, 1, (size_t)(height - y));
  return found == NULL ? height : found - needed;
}

// Sum the rows of a strip that are within the radius of a needed one, and some after them.
INLINE void sum_strip(const Blurring *work, Py_ssize_t strip, bool is_fused) {
  const Py_ssize_t height = work->image.height, step = work->image.step;
  const uint8_t *needed = work->needed + strip * height;
  const Pixel *pixels = work->pixels + strip * STRIP - RADIUS;
  Py_ssize_t next = -RADIUS;  // the first row that is not summed yet
  for (Py_ssize_t y = next_needed(needed, 0, height); y < height;
       y = next_needed(needed, y + 1, height)) {
    for (next = next < y - RADIUS ? y - RADIUS : next; next <= y + RADIUS; next += ROWS)
      sum_rows(pixels + next * step, step, work->next_sums + (next + RADIUS) * STRIP, is_fused);
  }
}

// Write the needed rows of a strip, from its sums.
INLINE void write_strip(const Blurring *work, Py_ssize_t strip, bool is_fused) {
  const Py_ssize_t height = work->image.height, left = work->image.width - strip * STRIP;
  const uint8_t *needed = work->needed + strip * height;
  for (Py_ssize_t y = next_needed(needed, 0, height); y < height;
       y = next_needed(needed, y + 1, height)) {
    Pixel *pixels = work->pixels + y * work->image.step + strip * STRIP;
    for (Py_ssize_t column = 0; column < STRIP && column < left; column += EIGHT) {
      const Bytes blurred = sum_columns(work->sums + (y + RADIUS) * STRIP + column, is_fused);
      if (column + EIGHT <= left)
        memcpy(pixels + column, &blurred, sizeof(blurred));
      else
        memcpy(pixels + column, &blurred, (size_t)(left - column));
    }
  }
}

// Each strip is written when the one after it is summed, which depends on its pixels.
INLINE void blur_strips(Blurring *work, bool is_fused) {
  for (Py_ssize_t strip = 0; strip <= work->strip_count; ++strip) {
    if (strip < work->strip_count)
      sum_strip(work, strip, is_fused);
    if (strip > 0)
      write_strip(work, strip - 1, is_fused);
    float *const sums = work->sums;
    work->sums = work->next_sums;
    work->next_sums = sums;
  }
}

FOR_EACH_FUSING_PROCESSOR
static void blur_fused(Blurring *work) { blur_strips(work, true); }

static void blur_apart(Blurring *work) { blur_strips(work, false); }

void blur(Blurring *blurring, bool is_fused) {
  if (is_fused)
    blur_fused(blurring);
  else
    blur_apart(blurring);
}

bool begin_blurring(Blurring *blurring, const Image *image, Pixel *pixels) {
  const Py_ssize_t strip_count = (image->width + STRIP - 1) / STRIP;
  const size_t sums = (size_t)((image->height + 2 * RADIUS + ROWS) * STRIP);
  *blurring = (Blurring){*image, pixels, strip_count,
                         calloc((size_t)(strip_count * image->height), 1),
                         malloc(sums * sizeof(float)), malloc(sums * sizeof(float))};
  return blurring->needed != NULL && blurring->sums != NULL && blurring->next_sums != NULL;
}

void need_around(Blurring *blurring, Py_ssize_t x, Py_ssize_t y, Py_ssize_t distance) {
  const Py_ssize_t height = blurring->image.height, right = blurring->image.width - 1;
  const Py_ssize_t first = (x > distance ? x - distance : 0) / STRIP;
  const Py_ssize_t last = (x + distance < right ? x + distance : right) / STRIP;
  const Py_ssize_t top = y > distance ? y - distance : 0;
  const Py_ssize_t below = y + distance + 1 < height ? y + distance + 1 : height;
  for (Py_ssize_t strip = first; strip <= last; ++strip)
    memset(blurring->needed + strip * height + top, 1, (size_t)(below - top));
}

void end_blurring(Blurring *blurring) {
  free(blurring->needed);
  free(blurring->sums);
  free(blurring->next_sums);
}
