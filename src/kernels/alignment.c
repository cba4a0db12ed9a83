// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Windows of one image found in another: the displacement with the least squared difference of
// grey levels, by Gauss-Newton steps (Lucas and Kanade 1981; Bouguet 2001, without the pyramid).

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "arrays.h"
#include "bordered.h"
#include "fetch.h"
#include "kernels.h"
#include "lanes.h"
#include "processors.h"

enum {
  LANES = EIGHT,      // pixels of a row that are looked at together
  LARGEST_SIDE = 64,  // of a window [px]
  MOST_STEPS = 20,
};

// Chosen, as those of OpenCV: two steps whose sum is smaller [px] go to and fro, and half of the
// last one is taken back; with a smaller eigenvalue of the mean products of gradients [1/px^2] a
// window has no texture.
static const float SMALLEST_ADVANCE = 0.01f, SMALLEST_TEXTURE = 0.1f;

// A window: rows of whole lanes, of which those beyond its side have no gradient.
typedef struct {
  Py_ssize_t side, width, step;     // of the rows of the patch
  float *grey, *along_u, *along_v;  // grey levels and their gradients [1/px]
  float *patch;                     // grey levels with one pixel around, and lanes to spare
  float *units;                     // of Scharr's sums in a row [1/px], 0 beyond the side
  float *offsets;                   // of the patch from its centre, the last one beyond its side
  float uu, uv, vv;                 // sums of the products of gradients
} Window;

// A place in an image: the pixel before it, and how far it is beyond.
typedef struct {
  const Pixel *pixel;
  float u, v;
} Place;

// Whether a window whose first pixel is at (u, v) touches the image; also false for NaN.
INLINE bool touches(const Image *image, Py_ssize_t side, float u, float v) {
  return u >= (float)-side && v >= (float)-side && u < (float)image->width &&
         v < (float)image->height;
}

INLINE Place place_at(const Image *image, float u, float v) {
  const float column = floorf(u), row = floorf(v);
  return (Place){image->pixels + (Py_ssize_t)row * image->step + (Py_ssize_t)column, u - column,
                 v - row};
}

// Grey levels between neighbours of a row.
INLINE Floats interpolate(const Pixel *pixels, float fraction) {
  const Floats left = to_floats(to_integers(load_pixels(pixels)));
  return left + fraction * (to_floats(to_integers(load_pixels(pixels + 1))) - left);
}

INLINE float sum_of(Floats f) {
  const Quads halves = (Quads){f[0], f[1], f[2], f[3]} + (Quads){f[4], f[5], f[6], f[7]};
  return (halves[0] + halves[2]) + (halves[1] + halves[3]);
}

// The grey levels of a window with one pixel around, in whole lanes.
INLINE void sample_patch(const Window *window, const Image *image, Place place) {
  const Py_ssize_t rows = window->side + 2, step = window->step, columns = image->step;
  for (Py_ssize_t first = 0; first < rows; first += LANES) {
    const Pixel *pixel = place.pixel + first;
    float *patch = window->patch + first;
    Floats above = interpolate(pixel, place.u);
    for (Py_ssize_t row = 0; row < rows; ++row, patch += step) {
      pixel += columns;
      const Floats below = interpolate(pixel, place.u);
      store(above + place.v * (below - above), patch);
      above = below;
    }
  }
}

// Where the pixels of a window are in the image before: by columns and rows from its centre.
typedef struct {
  float centre[2];
  float by_column[2], by_row[2];  // [px/px]
} Lattice;

INLINE bool is_upright(const Lattice *lattice) {
  return lattice->by_column[0] == 1.0f && lattice->by_column[1] == 0.0f &&
         lattice->by_row[0] == 0.0f && lattice->by_row[1] == 1.0f;
}

// Whether an image and its border have all neighbours of what a lattice reaches on each side; also
// false for NaN.
INLINE bool has_all_of(const Image *image, float border, const Lattice *lattice, float reach) {
  const float lengths[] = {(float)image->width, (float)image->height};
  for (int axis = 0; axis < 2; ++axis) {
    const float beside = reach * (fabsf(lattice->by_column[axis]) + fabsf(lattice->by_row[axis]));
    const float centre = lattice->centre[axis];
    if (!(centre - beside >= 1.0f - border && centre + beside <= lengths[axis] + border - 3.0f))
      return false;
  }
  return true;
}

// Two neighbours of a row each, of which the first is the lower byte.
INLINE uint16_t load_two(const Pixel *pixels) { return (uint16_t)(pixels[0] | pixels[1] << 8); }

INLINE Floats between(UnsignedShorts neighbours, Floats fraction) {
  const Floats left = to_floats(to_integers((Shorts)(neighbours & 255)));
  const Floats right = to_floats(to_integers((Shorts)(neighbours >> 8)));
  return left + fraction * (right - left);
}

// Grey levels at places, which are not negative.
INLINE Floats sample(const Image *image, const Pixel *pixels, Floats u, Floats v) {
  const Integers columns = __builtin_convertvector(u, Integers);
  const Integers rows = __builtin_convertvector(v, Integers);
  const Integers places = rows * (int32_t)image->step + columns;
  UnsignedShorts above, below;
  for (int lane = 0; lane < LANES; ++lane) {
    const Pixel *pixel = pixels + places[lane];
    above[lane] = load_two(pixel);
    below[lane] = load_two(pixel + image->step);
  }
  const Floats first = between(above, u - to_floats(columns));
  return first + (v - to_floats(rows)) * (between(below, u - to_floats(columns)) - first);
}

// The patch of a window whose pixels are not beside each other in an image.
INLINE void sample_lattice(const Window *window, const Image *image, Py_ssize_t border,
                           const Lattice *lattice) {
  const Pixel *pixels = image->pixels - border * image->step - border;
  const Py_ssize_t rows = window->side + 2, step = window->step;
  for (Py_ssize_t row = 0; row < rows; ++row) {
    const float y = window->offsets[row];
    const float u = lattice->centre[0] + (float)border + y * lattice->by_row[0];
    const float v = lattice->centre[1] + (float)border + y * lattice->by_row[1];
    for (Py_ssize_t first = 0; first < rows; first += LANES) {
      const Floats x = load(window->offsets + first);
      store(sample(image, pixels, u + x * lattice->by_column[0], v + x * lattice->by_column[1]),
            window->patch + row * step + first);
    }
  }
}

// What Scharr's operator makes of a row: differences along it, and means of neighbours.
typedef struct {
  Floats difference, mean;
} Row;

INLINE Row row_of(const float *patch) {
  const Floats left = load(patch), right = load(patch + 2);
  return (Row){right - left, 3.0f * (left + right) + 10.0f * load(patch + 1)};
}

// Measure a window by its patch: grey levels, and gradients by Scharr's operator.
INLINE void measure(Window *window) {
  const Py_ssize_t side = window->side, width = window->width, step = window->step;
  Floats uu = {0}, uv = {0}, vv = {0};
  for (Py_ssize_t first = 0; first < width; first += LANES) {
    const Floats unit = load(window->units + first);
    const float *patch = window->patch + first;
    float *grey = window->grey + first;
    float *along_u = window->along_u + first, *along_v = window->along_v + first;
    Row above = row_of(patch), middle = row_of(patch + step);
    for (Py_ssize_t row = 0; row < side; ++row) {
      const Row below = row_of(patch + (row + 2) * step);
      const Floats ends = above.difference + below.difference;
      const Floats by_u = unit * (3.0f * ends + 10.0f * middle.difference);
      const Floats by_v = unit * (below.mean - above.mean);
      store(load(patch + (row + 1) * step + 1), grey + row * width);
      store(by_u, along_u + row * width);
      store(by_v, along_v + row * width);
      uu += by_u * by_u;
      uv += by_u * by_v;
      vv += by_v * by_v;
      above = middle;
      middle = below;
    }
  }
  window->uu = sum_of(uu);
  window->uv = sum_of(uv);
  window->vv = sum_of(vv);
}

// Whether a window shows where it is in both directions.
INLINE bool has_texture(const Window *window) {
  const float difference = window->uu - window->vv;
  const float root = sqrtf(difference * difference + 4.0f * window->uv * window->uv);
  const float pixels = (float)(window->side * window->side);
  return window->uu + window->vv - root >= 2.0f * SMALLEST_TEXTURE * pixels &&
         window->uu * window->vv - window->uv * window->uv > FLT_EPSILON;
}

// Sums of the gradients of a window times what an image is brighter.
typedef struct {
  Floats by_u, by_v;
} Sums;

INLINE void add_row(Sums *sums, const Window *window, Py_ssize_t start, Floats seen) {
  const Floats brighter = seen - load(window->grey + start);
  sums->by_u += brighter * load(window->along_u + start);
  sums->by_v += brighter * load(window->along_v + start);
}

// Compare a window with the image at a place. Two rows at a time have sums of their own, which do
// not wait for each other.
INLINE void compare(const Window *window, const Image *image, Place place, float *by_u,
                    float *by_v) {
  const Py_ssize_t side = window->side, width = window->width, columns = image->step;
  Sums sums = {{0}, {0}}, others = {{0}, {0}};
  for (Py_ssize_t first = 0; first < width; first += LANES) {
    const Pixel *pixel = place.pixel + first;
    Floats above = interpolate(pixel, place.u);
    Py_ssize_t row = 0;
    for (; row + 1 < side; row += 2) {
      const Floats middle = interpolate(pixel + (row + 1) * columns, place.u);
      const Floats below = interpolate(pixel + (row + 2) * columns, place.u);
      add_row(&sums, window, row * width + first, above + place.v * (middle - above));
      add_row(&others, window, (row + 1) * width + first, middle + place.v * (below - middle));
      above = below;
    }
    if (row < side) {
      const Floats below = interpolate(pixel + (row + 1) * columns, place.u);
      add_row(&sums, window, row * width + first, above + place.v * (below - above));
    }
  }
  *by_u = sum_of(sums.by_u + others.by_u);
  *by_v = sum_of(sums.by_v + others.by_v);
}

// Move the first pixel of a window to where an image shows it; false where it leaves the image.
// A step that is not larger [px] is the last one.
INLINE bool align(const Window *window, const Image *image, float last_step, float *u, float *v) {
  const float inverse = 1.0f / (window->uu * window->vv - window->uv * window->uv);
  const float uu = inverse * window->uu, uv = inverse * window->uv, vv = inverse * window->vv;
  float before_u = 0.0f, before_v = 0.0f;  // the step before
  for (int i = 0; i < MOST_STEPS; ++i) {
    if (!touches(image, window->side, *u, *v))
      return false;
    float by_u, by_v;
    compare(window, image, place_at(image, *u, *v), &by_u, &by_v);
    const float du = uv * by_v - vv * by_u, dv = uv * by_u - uu * by_v;
    *u += du;
    *v += dv;
    if (du * du + dv * dv <= last_step * last_step)
      break;
    if (i > 0 && fabsf(du + before_u) < SMALLEST_ADVANCE &&
        fabsf(dv + before_v) < SMALLEST_ADVANCE) {
      *u -= 0.5f * du;
      *v -= 0.5f * dv;
      break;
    }
    before_u = du;
    before_v = dv;
  }
  return true;
}

// Take what an image shows on a lattice; false where that is not in it and its border.
INLINE bool take(Window *window, const Image *image, Py_ssize_t border, const Lattice *lattice) {
  const float half = 0.5f * (float)(window->side - 1);
  const float u = lattice->centre[0] - half, v = lattice->centre[1] - half;
  if (!touches(image, window->side, u, v))
    return false;
  if (is_upright(lattice))
    sample_patch(window, image, place_at(image, u - 1.0f, v - 1.0f));
  else if (has_all_of(image, (float)border, lattice, half + 1.0f))
    sample_lattice(window, image, border, lattice);
  else
    return false;
  return true;
}

// Fetch a window of an image, whose first pixel is at (u, v).
INLINE void fetch(const Image *image, Py_ssize_t side, float u, float v) {
  if (touches(image, side, u, v))
    fetch_rows(place_at(image, u - 1.0f, v - 1.0f).pixel, side + 2, side + 2, image->step);
}

// Find the windows on lattices of one image in another, from places there. A scale makes pixels of
// the images of the pixels and places.
FOR_EACH_PROCESSOR
static void align_all(Window *window, const Image *before, const Image *now, Py_ssize_t border,
                      float step, float scale, const float (*pixels)[2],
                      const double (*warps)[2][2], float (*places)[2], Py_ssize_t count,
                      Pixel *found) {
  const float half = 0.5f * (float)(window->side - 1);
  for (Py_ssize_t i = 0; i < count; ++i) {
    Lattice lattice = {{pixels[i][0] * scale, pixels[i][1] * scale}, {1.0f, 0.0f}, {0.0f, 1.0f}};
    for (int k = 0; k < 2 && warps != NULL; ++k) {
      lattice.by_column[k] = (float)warps[i][k][0];
      lattice.by_row[k] = (float)warps[i][k][1];
    }
    if (i + 1 < count) {
      fetch(before, window->side, pixels[i + 1][0] * scale - half,
            pixels[i + 1][1] * scale - half);
      fetch(now, window->side, places[i + 1][0] * scale - half, places[i + 1][1] * scale - half);
    }
    found[i] = take(window, before, border, &lattice);
    if (!found[i])
      continue;
    measure(window);
    float place[2] = {places[i][0] * scale - half, places[i][1] * scale - half};
    found[i] = has_texture(window) && align(window, now, step, &place[0], &place[1]);
    if (found[i]) {
      places[i][0] = (place[0] + half) / scale;
      places[i][1] = (place[1] + half) / scale;
    }
  }
}

// Make room for a window; its grey levels are NULL without memory.
static Window make_window(Py_ssize_t side) {
  const Py_ssize_t width = (side + LANES - 1) / LANES * LANES;
  Window window = {.side = side, .width = width, .step = width + LANES};
  const Py_ssize_t size = side * width, patch_size = (side + 2) * window.step;
  window.grey = calloc((size_t)(3 * size + patch_size + width + window.step),
                       sizeof(*window.grey));
  if (window.grey == NULL)
    return window;
  window.along_u = window.grey + size;
  window.along_v = window.along_u + size;
  window.patch = window.along_v + size;
  window.units = window.patch + patch_size;
  for (Py_ssize_t column = 0; column < side; ++column)
    window.units[column] = 1.0f / 32.0f;
  window.offsets = window.units + width;
  const float reach = 0.5f * (float)(side + 1);
  for (Py_ssize_t column = 0; column < window.step; ++column)
    window.offsets[column] = fminf((float)column - reach, reach);
  return window;
}

PyObject *kernel_align_windows(PyObject *module, PyObject *arguments) {
  PyObject *before_array, *now_array, *pixel_array, *warp_array, *place_array, *found_array;
  Py_ssize_t border, side;
  float step, scale;
  if (!PyArg_ParseTuple(arguments, "OOnnffOOOO", &before_array, &now_array, &border, &side,
                        &step, &scale, &pixel_array, &warp_array, &place_array, &found_array))
    return NULL;
  const Py_ssize_t count = row_count(pixel_array);
  const Argument needed[] = {
      {"the image before", before_array, 'B', IMAGE, false},
      {"the image now", now_array, 'B', IMAGE, false},
      {"the pixels", pixel_array, 'f', 2 * count, false},
      {"the warps", warp_array, 'd', 4 * count, false, true},
      {"the places", place_array, 'f', 2 * count, true},
      {"the found", found_array, '?', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  Window window = {0};
  Image before, now;
  if (side < 1 || side > LARGEST_SIDE) {
    PyErr_Format(PyExc_ValueError, "windows of %zd pixels: 1 to %d are required", side,
                 LARGEST_SIDE);
  } else if (set_image(&arrays.views[0], border, side + 2 * LANES, &before) &&
             set_image(&arrays.views[1], border, side + 2 * LANES, &now)) {
    window = make_window(side);
    if (window.grey == NULL)
      PyErr_NoMemory();
  }
  const bool is_made = window.grey != NULL;
  if (is_made) {
    Py_BEGIN_ALLOW_THREADS
    align_all(&window, &before, &now, border, step, scale, arrays.views[2].buf,
              arrays.views[3].buf, arrays.views[4].buf, count, arrays.views[5].buf);
    Py_END_ALLOW_THREADS
  }
  free(window.grey);
  close_arrays(&arrays);
  if (!is_made)
    return NULL;
  Py_RETURN_NONE;
}
