// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Corners of an image: FAST (Rosten and Drummond 2006), ranked by the response of Harris and
// Stephens (1988), and the orientation by the centroid of a patch (Rosin 1999).

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "arrays.h"
#include "bordered.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum {
  RING = 16,          // pixels of the circle about a corner
  RADIUS = 3,         // of that circle
  LANES = 32,         // pixels that are looked at together
  SPARE = 2 * LANES,  // scores of a row beyond the image, which lanes read and write
  WORD = 8,           // scores in an integer
  FIRST_ROOM = 1024,  // corners that a list has room for at first
  BLOCK = 7,          // side of the block of Harris' response
  BLOCK_LANES = EIGHT,  // the same with one to spare
  REACH = 5,          // pixels around a corner that its response reads
  SCORES = 256,
  LARGEST_RADIUS = 1024,  // of a disc, whose sums fit into 32 bits
};

static const float HARRIS_K = 0.04f;

typedef struct {
  int32_t x, y;
  Pixel score;
} Corner;

static inline Pixel least(Pixel a, Pixel b) { return a < b ? a : b; }

static inline Pixel most(Pixel a, Pixel b) { return a > b ? a : b; }

// The scores of pixels side by side: the largest threshold at which nine pixels in a row on the
// circle are all brighter or all darker by more, 0 where that is below the threshold.
static inline void score_pixels(const Pixel *row, const Py_ssize_t *ring, Pixel threshold,
                                Pixel *scores) {
  Pixel found[LANES];
  for (int lane = 0; lane < LANES; ++lane) {
    const Pixel *pixel = row + lane;
    Pixel p[RING], low[RING], high[RING];
    for (int k = 0; k < RING; ++k)
      p[k] = pixel[ring[k]];
    // least and most of the two, four and eight pixels that start at each odd one
    Pixel low4[RING], high4[RING];
    for (int k = 1; k < RING; k += 2) {
      low[k] = least(p[k], p[(k + 1) % RING]);
      high[k] = most(p[k], p[(k + 1) % RING]);
    }
    for (int k = 1; k < RING; k += 2) {
      low4[k] = least(low[k], low[(k + 2) % RING]);
      high4[k] = most(high[k], high[(k + 2) % RING]);
    }
    Pixel bright = 0, dark = UINT8_MAX;
    for (int k = 1; k < RING; k += 2) {
      // the ninth is the one before the eight or the one after them
      const Pixel before = p[k - 1], after = p[(k + 8) % RING];
      bright = most(bright, least(least(low4[k], low4[(k + 4) % RING]), most(before, after)));
      dark = least(dark, most(most(high4[k], high4[(k + 4) % RING]), least(before, after)));
    }
    const Pixel centre = *pixel;
    const Pixel contrast = most((Pixel)(most(bright, centre) - centre),
                                (Pixel)(centre - least(dark, centre)));
    found[lane] = contrast > threshold ? (Pixel)(contrast - 1) : 0;
  }
  memcpy(scores, found, LANES);
}

// Whether any of the pixels side by side may be a corner: nine in a row on the circle hold one of
// each two that are opposite each other.
static inline bool may_have_corner(const Pixel *row, const Py_ssize_t *ring, Pixel threshold) {
  Pixel any = 0;
  for (int lane = 0; lane < LANES; ++lane) {
    const Pixel *pixel = row + lane;
    const Pixel a = pixel[ring[0]], b = pixel[ring[4]], c = pixel[ring[8]], d = pixel[ring[12]];
    const Pixel centre = *pixel;
    const Pixel bright = least(most(a, c), most(b, d)), dark = most(least(a, c), least(b, d));
    const Pixel contrast = most((Pixel)(most(bright, centre) - centre),
                                (Pixel)(centre - least(dark, centre)));
    any = most(any, contrast);
  }
  return any > threshold;
}

// Write the scores of a row of pixels, 0 of those without a circle.
FOR_EACH_PROCESSOR
static void score_row(const Image *image, Py_ssize_t y, Pixel threshold, Pixel *scores) {
  static const int OFFSETS[RING][2] = {{0, 3},  {1, 3},   {2, 2},   {3, 1},   {3, 0},  {3, -1},
                                       {2, -2}, {1, -3},  {0, -3},  {-1, -3}, {-2, -2}, {-3, -1},
                                       {-3, 0}, {-3, 1},  {-2, 2},  {-1, 3}};
  Py_ssize_t ring[RING];
  for (int k = 0; k < RING; ++k)
    ring[k] = OFFSETS[k][0] + OFFSETS[k][1] * image->step;
  const Py_ssize_t end = image->width - RADIUS;
  const Pixel *row = image->pixels + y * image->step;
  memset(scores, 0, (size_t)(image->width + SPARE));
  for (Py_ssize_t x = RADIUS; x < end; x += LANES)
    if (may_have_corner(row + x, ring, threshold))
      score_pixels(row + x, ring, threshold, scores + x);
  memset(scores + end, 0, LANES);  // what is beyond the last pixel is none
}

static inline uint64_t word_at(const Pixel *scores) {
  uint64_t word;
  memcpy(&word, scores, WORD);
  return word;
}

// Write the scores that are larger than all eight around them, 0 for the others, side by side;
// return whether there may be any.
static inline bool find_peaks(const Pixel *above, const Pixel *row, const Pixel *below,
                              Pixel *peaks) {
  uint64_t any = 0;
  for (int lane = 0; lane < LANES; lane += WORD)
    any |= word_at(row + lane);
  if (any == 0)
    return false;
  for (int lane = 0; lane < LANES; ++lane) {
    const Pixel *a = above + lane, *p = row + lane, *b = below + lane;
    const Pixel around = most(most(most(a[-1], a[0]), most(a[1], p[-1])),
                              most(most(p[1], b[-1]), most(b[0], b[1])));
    peaks[lane] = *p > around ? *p : 0;
  }
  return true;
}

typedef struct {
  Corner *corners;
  Py_ssize_t count, room;
} CornerList;

// Make room for one more corner; return false, and keep the list, where there is no memory.
static bool has_room(CornerList *list) {
  if (list->count < list->room)
    return true;
  const Py_ssize_t room = list->room > 0 ? 2 * list->room : FIRST_ROOM;
  Corner *corners = realloc(list->corners, (size_t)room * sizeof(*corners));
  if (corners == NULL)
    return false;
  list->corners = corners;
  list->room = room;
  return true;
}

// List the peaks of row y from one column to another; false where there is no memory.
FOR_EACH_PROCESSOR
static bool list_peaks(const Pixel *above, const Pixel *row, const Pixel *below, Py_ssize_t y,
                       Py_ssize_t begin, Py_ssize_t end, CornerList *list) {
  for (Py_ssize_t x = begin; x < end; x += LANES) {
    Pixel peaks[LANES];
    if (!find_peaks(above + x, row + x, below + x, peaks))
      continue;
    for (int first = 0; first < LANES; first += WORD) {
      if (word_at(peaks + first) == 0)  // few are peaks: pass over eight at once
        continue;
      for (int lane = first; lane < first + WORD; ++lane) {
        if (peaks[lane] == 0 || x + lane >= end)
          continue;
        if (!has_room(list))
          return false;
        list->corners[list->count++] = (Corner){(int32_t)(x + lane), (int32_t)y, peaks[lane]};
      }
    }
  }
  return true;
}

// List the corners within an edge; rows has the scores of three rows. False without memory.
static bool list_corners(const Image *image, Pixel threshold, Py_ssize_t edge, Pixel *rows,
                         CornerList *list) {
  const Py_ssize_t step = image->width + SPARE, end = image->height - RADIUS;
  for (Py_ssize_t y = RADIUS; y <= end && image->width > 2 * RADIUS; ++y) {
    if (y < end)
      score_row(image, y, threshold, rows + y % 3 * step);
    else
      memset(rows + y % 3 * step, 0, (size_t)step);
    const Py_ssize_t peak = y - 1;
    if (peak >= edge && peak < image->height - edge &&
        !list_peaks(rows + (y + 1) % 3 * step, rows + peak % 3 * step, rows + y % 3 * step, peak,
                    edge, image->width - edge, list))
      return false;
  }
  return true;
}

// Keep the best corners, and all that are as good as the last one of them; return their number.
static Py_ssize_t keep_best(Corner *corners, Py_ssize_t count, Py_ssize_t wanted) {
  Py_ssize_t counts[SCORES] = {0}, kept = 0, better = 0;
  for (Py_ssize_t i = 0; i < count; ++i)
    ++counts[corners[i].score];
  int lowest = SCORES;
  while (lowest > 0 && better < wanted)
    better += counts[--lowest];
  for (Py_ssize_t i = 0; i < count; ++i)
    if (corners[i].score >= lowest)
      corners[kept++] = corners[i];
  return kept;
}

// What Sobel's operator makes of a row: differences along it, and sums of neighbours.
typedef struct {
  Shorts difference, sum;
} Row;

INLINE Row row_of(const Pixel *pixels) {
  const Shorts left = load_pixels(pixels - 1), right = load_pixels(pixels + 1);
  return (Row){right - left, left + 2 * load_pixels(pixels) + right};
}

INLINE int32_t sum_of_block(Integers lanes) {
  int32_t sum = 0;
  for (int lane = 0; lane < BLOCK; ++lane)
    sum += lanes[lane];
  return sum;
}

// Harris' response of the block about a pixel.
INLINE float harris_response(const Image *image, Py_ssize_t x, Py_ssize_t y) {
  Integers xx = {0}, yy = {0}, xy = {0};
  const Pixel *pixels = image->pixels + (y - BLOCK / 2 - 1) * image->step + x - BLOCK / 2;
  Row above = row_of(pixels), middle = row_of(pixels + image->step);
  for (int row = 0; row < BLOCK; ++row) {
    const Row below = row_of(pixels + (row + 2) * image->step);
    const Integers dx =
        to_integers(above.difference + 2 * middle.difference + below.difference);
    const Integers dy = to_integers(below.sum - above.sum);
    xx += dx * dx;
    yy += dy * dy;
    xy += dx * dy;
    above = middle;
    middle = below;
  }
  const float a = (float)sum_of_block(xx), b = (float)sum_of_block(yy);
  const float c = (float)sum_of_block(xy);
  const float unit = 1.0f / (4 * BLOCK * 255.0f);  // makes derivatives of grey levels 0 to 1
  const float trace = a + b;
  return (a * b - c * c - HARRIS_K * trace * trace) * (unit * unit * unit * unit);
}

FOR_EACH_PROCESSOR
static void write_responses(const Image *image, const Corner *corners, Py_ssize_t count,
                            float (*found)[3]) {
  for (Py_ssize_t i = 0; i < count; ++i) {
    found[i][0] = (float)corners[i].x;
    found[i][1] = (float)corners[i].y;
    found[i][2] = harris_response(image, corners[i].x, corners[i].y);
  }
}

PyObject *kernel_corners(PyObject *module, PyObject *arguments) {
  PyObject *image_array;
  Image image;
  Py_ssize_t border, edge, wanted;
  Pixel threshold;
  if (!PyArg_ParseTuple(arguments, "Onbnn", &image_array, &border, &threshold, &edge, &wanted))
    return NULL;
  const Argument needed[] = {{"the image", image_array, 'B', IMAGE, false}};
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  if (!set_image(&arrays.views[0], border, REACH, &image)) {
    close_arrays(&arrays);
    return NULL;
  }
  edge = edge > RADIUS ? edge : RADIUS;
  Pixel *rows = calloc(3, (size_t)(image.width + SPARE));
  CornerList list = {0};
  bool is_complete = rows != NULL;
  if (is_complete) {
    Py_BEGIN_ALLOW_THREADS
    is_complete = list_corners(&image, threshold, edge, rows, &list);
    Py_END_ALLOW_THREADS
  }
  PyObject *bytes = NULL;
  if (is_complete) {
    const Py_ssize_t count = keep_best(list.corners, list.count, wanted);
    float(*found)[3];
    bytes = PyBytes_FromStringAndSize(NULL, count * (Py_ssize_t)sizeof(*found));
    if (bytes != NULL) {
      found = (float(*)[3])(void *)PyBytes_AsString(bytes);
      write_responses(&image, list.corners, count, found);
    }
  } else {
    PyErr_NoMemory();
  }
  free(rows);
  free(list.corners);
  close_arrays(&arrays);
  return bytes;
}

// A disc: for each of its rows, side by side, the pixels that are in it, up to whole lanes.
typedef struct {
  int32_t *inside;  // all bits set in the disc, none beside it
  Py_ssize_t radius, width;
} Disc;

// Make a disc from half the widths of its rows, from the middle one on; inside is NULL without
// memory for it.
static Disc make_disc(const int64_t *half_widths, Py_ssize_t radius) {
  Disc disc = {NULL, radius, (2 * radius + BLOCK_LANES) / BLOCK_LANES * BLOCK_LANES};
  disc.inside = calloc((size_t)((2 * radius + 1) * disc.width), sizeof(*disc.inside));
  if (disc.inside == NULL)
    return disc;
  for (Py_ssize_t row = 0; row <= 2 * radius; ++row) {
    const Py_ssize_t half = half_widths[row < radius ? radius - row : row - radius];
    for (Py_ssize_t column = radius - half; column <= radius + half; ++column)
      disc.inside[row * disc.width + column] = -1;
  }
  return disc;
}

// The first moments of the grey levels in a disc about a pixel.
FOR_EACH_PROCESSOR
static void disc_moments(const Image *image, Py_ssize_t x, Py_ssize_t y, const Disc *disc,
                         double *moments) {
  const Py_ssize_t radius = disc->radius, rows = 2 * radius + 1;
  int64_t along_x = 0, along_y = 0;
  for (Py_ssize_t first = 0; first < disc->width; first += BLOCK_LANES) {
    const Pixel *pixels = image->pixels + (y + radius) * image->step + x - radius + first;
    const int32_t *inside = disc->inside + (rows - 1) * disc->width + first;
    Integers sums = {0}, sums_of_sums = {0};
    for (Py_ssize_t row = 0; row < rows; ++row) {
      Integers mask;
      memcpy(&mask, inside - row * disc->width, sizeof(mask));
      sums += to_integers(load_pixels(pixels - row * image->step)) & mask;
      sums_of_sums += sums;  // counts a row once more than its number
    }
    for (int lane = 0; lane < BLOCK_LANES; ++lane) {
      along_x += (first + lane - radius) * sums[lane];
      along_y += sums_of_sums[lane] - (radius + 1) * (int64_t)sums[lane];
    }
  }
  moments[0] = (double)along_x;
  moments[1] = (double)along_y;
}

// The direction of a vector in degrees, 0 to 360, as OpenCV's fastAtan2: to the same digit.
static float direction_of(float x, float y) {
  const float degrees = (float)(180.0 / 3.14159265358979323846), smallest = (float)DBL_EPSILON;
  const float across = fabsf(x), along = fabsf(y);
  const float least = across < along ? across : along, largest = across < along ? along : across;
  const float t = least / (largest + smallest), square = t * t;
  float angle = (((-0.04432655554792128f * degrees * square + 0.1555786518463281f * degrees) *
                      square -
                  0.3258083974640975f * degrees) *
                     square +
                 0.9997878412794807f * degrees) *
                t;
  angle = across >= along ? angle : 90.0f - angle;
  angle = x < 0.0f ? 180.0f - angle : angle;
  return y < 0.0f ? 360.0f - angle : angle;
}

// Whether all of the discs lie in an image and its border, with lanes to spare.
static bool are_inside(const Image *image, Py_ssize_t border, const int64_t *half_widths,
                       Py_ssize_t radius, const float (*points)[2], Py_ssize_t count) {
  bool is_inside = radius >= 0 && radius <= LARGEST_RADIUS && radius + BLOCK_LANES <= border;
  for (Py_ssize_t row = 0; row <= radius; ++row)
    is_inside = is_inside && half_widths[row] >= 0 && half_widths[row] <= radius;
  for (Py_ssize_t i = 0; i < count; ++i)
    is_inside = is_inside && points[i][0] >= 0.0f && points[i][0] < (float)image->width &&
                points[i][1] >= 0.0f && points[i][1] < (float)image->height;
  return is_inside;
}

PyObject *kernel_disc_directions(PyObject *module, PyObject *arguments) {
  PyObject *image_array, *width_array, *point_array, *direction_array;
  Image image;
  Py_ssize_t border;
  if (!PyArg_ParseTuple(arguments, "OnOOO", &image_array, &border, &width_array, &point_array,
                        &direction_array))
    return NULL;
  const Py_ssize_t radius = row_count(width_array) - 1;
  const Py_ssize_t count = row_count(point_array);
  const Argument needed[] = {
      {"the image", image_array, 'B', IMAGE, false},
      {"the half widths", width_array, 'q', radius + 1, false},
      {"the points", point_array, 'f', 2 * count, false},
      {"the directions", direction_array, 'd', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  const int64_t *half_widths = arrays.views[1].buf;
  const float(*points)[2] = arrays.views[2].buf;
  double *directions = arrays.views[3].buf;
  Disc disc = {0};
  if (set_image(&arrays.views[0], border, REACH, &image)) {
    if (!are_inside(&image, border, half_widths, radius, points, count)) {
      PyErr_SetString(PyExc_ValueError, "a disc is not within the image and its border");
    } else {
      disc = make_disc(half_widths, radius);
      if (disc.inside == NULL)
        PyErr_NoMemory();
    }
  }
  const bool is_made = disc.inside != NULL;
  if (is_made) {
    Py_BEGIN_ALLOW_THREADS
    for (Py_ssize_t i = 0; i < count; ++i) {
      double moments[2];
      disc_moments(&image, (Py_ssize_t)points[i][0], (Py_ssize_t)points[i][1], &disc, moments);
      directions[i] = direction_of((float)moments[0], (float)moments[1]);
    }
    Py_END_ALLOW_THREADS
  }
  free(disc.inside);
  close_arrays(&arrays);
  if (!is_made)
    return NULL;
  Py_RETURN_NONE;
}
