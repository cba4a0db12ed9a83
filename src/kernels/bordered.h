// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Images with a border around them, so that what reads beyond their edges need not ask.

#ifndef AICK_ROS_BORDERED_H
#define AICK_ROS_BORDERED_H

#include <stdint.h>

#include "arrays.h"

typedef uint8_t Pixel;

typedef struct {
  const Pixel *pixels;  // the first one within the border
  Py_ssize_t height, width, step;
} Image;

// Set an image from an opened one with a border; false, with a ValueError, where the border is
// narrower than the least, or none is left.
bool set_image(const Py_buffer *view, Py_ssize_t border, Py_ssize_t least, Image *image);

// Fill the border of an image, whose pixels these are: mirrored at the centres of the outermost
// pixels, of which there are two at least along each side.
void mirror(const Image *image, Pixel *pixels, Py_ssize_t border);

#endif
