// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// A Gaussian blur of those parts of an image that are needed, in place.

#ifndef AICK_ROS_BLURRING_H
#define AICK_ROS_BLURRING_H

#include <stdbool.h>

#include "bordered.h"

enum { BLURRED_BORDER = 20 };  // the least border of an image to be blurred: what is read of it

typedef struct {
  Image image;
  Pixel *pixels;           // those of the image, to be written
  Py_ssize_t strip_count;  // of columns of the image
  uint8_t *needed;         // for each strip, its rows: 1 where they are needed
  float *sums, *next_sums;  // of the rows of a strip, and of the strip after it
} Blurring;

// Prepare for an image in which nothing is needed; false without memory for it. To be ended in
// either case.
bool begin_blurring(Blurring *blurring, const Image *image, Pixel *pixels);

// Need the pixels up to a distance along both axes from one that is in the image.
void need_around(Blurring *blurring, Py_ssize_t x, Py_ssize_t y, Py_ssize_t distance);

// Blur what is needed, and some pixels beside it; none of the border. Products and sums are
// rounded at once where they are fused.
void blur(Blurring *blurring, bool is_fused);

void end_blurring(Blurring *blurring);

#endif
