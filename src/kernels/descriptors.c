// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Distances of binary descriptors: the fraction of differing bits.

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "arrays.h"
#include "kernels.h"
#include "lanes.h"
#include "pairs.h"
#include "processors.h"

enum {
  WORD = 8, ORB = 32, WIDEST = 1 << 20,  // bytes: compared at once; of a descriptor
  BLOCK = 16,  // descriptors that are looked at together, as few of them are similar
};

static inline uint64_t word_at(const unsigned char *bytes, Py_ssize_t size) {
  uint64_t word = 0;
  memcpy(&word, bytes, (size_t)size);
  return word;
}

static inline int set_bits(uint64_t word) {
#ifdef __GNUC__
  return __builtin_popcountll(word);
#else
  word -= word >> 1 & 0x5555555555555555;
  word = (word & 0x3333333333333333) + (word >> 2 & 0x3333333333333333);
  word = (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0f;
  return (int)(word * 0x0101010101010101 >> 56);
#endif
}

// A word of a descriptor; what the last one has beyond its width is 0.
static inline uint64_t nth_word(const unsigned char *descriptor, Py_ssize_t n, Py_ssize_t width) {
  const Py_ssize_t left = width - n * WORD;
  return left < WORD ? word_at(descriptor + n * WORD, left) : word_at(descriptor + n * WORD, WORD);
}

static inline int differing_bits(const unsigned char *a, const unsigned char *b,
                                 Py_ssize_t width) {
  int bits = 0;
  Py_ssize_t i = 0;
  for (; i + WORD <= width; i += WORD)
    bits += set_bits(word_at(a + i, WORD) ^ word_at(b + i, WORD));
  if (i < width)
    bits += set_bits(word_at(a + i, width - i) ^ word_at(b + i, width - i));
  return bits;
}

// One bit as a fraction of all bits.
static float fraction(Py_ssize_t width) { return (float)(1.0 / (8.0 * (double)width)); }

typedef struct {
  const unsigned char *source, *target;
  Py_ssize_t source_count, target_count, width;
} Descriptors;

// Set the counts of two arrays; return false, with a ValueError, where no descriptor is so wide.
static bool has_counts(Descriptors *d, PyObject *source, PyObject *target) {
  if (d->width < 1 || d->width > WIDEST) {
    PyErr_Format(PyExc_ValueError, "the width of the descriptors is %zd: 1 to %d are required",
                 d->width, WIDEST);
    return false;
  }
  d->source_count = row_count(source);
  d->target_count = row_count(target);
  return true;
}

static inline void compare_row(const unsigned char *source, const Descriptors *d,
                               Py_ssize_t width, float *distances) {
  const float unit = fraction(width);
  for (Py_ssize_t j = 0; j < d->target_count; ++j)
    distances[j] = (float)differing_bits(source, d->target + width * j, width) * unit;
}

// Write the distances of one descriptor from all of the target.
FOR_EACH_PROCESSOR
static void compare_to_all(const Descriptors *d, Py_ssize_t row, float *distances) {
  const unsigned char *source = d->source + d->width * row;
  if (d->width == ORB)  // twice as fast where the compiler knows the width
    compare_row(source, d, ORB, distances);
  else
    compare_row(source, d, d->width, distances);
}

FOR_EACH_PROCESSOR
static bool compare_pairs(const Descriptors *d, const int64_t *source_rows,
                          const int64_t *target_rows, Py_ssize_t count, float *distances) {
  const float unit = fraction(d->width);
  for (Py_ssize_t k = 0; k < count; ++k) {
    const int64_t i = source_rows[k], j = target_rows[k];
    if (i < 0 || i >= d->source_count || j < 0 || j >= d->target_count)
      return false;
    distances[k] = (float)differing_bits(d->source + d->width * i, d->target + d->width * j,
                                         d->width) * unit;
  }
  return true;
}

// The descriptors of a target word by word: the first words of all of them, up to whole blocks,
// then the second ones, and so on.
typedef struct {
  uint64_t *words;
  Py_ssize_t per_descriptor, step;
} Words;

// The words are NULL without memory for them.
static Words words_of(const Descriptors *d) {
  Words words = {NULL, (d->width + WORD - 1) / WORD,
                 (d->target_count + BLOCK - 1) / BLOCK * BLOCK};
  words.words = calloc((size_t)(words.per_descriptor * words.step) + 1, sizeof(*words.words));
  for (Py_ssize_t i = 0; i < d->target_count && words.words != NULL; ++i)
    for (Py_ssize_t k = 0; k < words.per_descriptor; ++k)
      words.words[k * words.step + i] = nth_word(d->target + i * d->width, k, d->width);
  return words;
}

// Count the bits of a block of descriptors that differ from one, whose words these are. The loops
// are left as they are until they are vectorised.
INLINE void count_bits(const uint64_t *restrict target, Py_ssize_t step, Py_ssize_t count,
                       const unsigned char *source, Py_ssize_t width, uint64_t *restrict bits) {
  for (Py_ssize_t k = 0; k < count; ++k) {
    const uint64_t word = nth_word(source, k, width);
#pragma GCC unroll 1
    for (int j = 0; j < BLOCK; ++j) {
      const uint64_t more = (uint64_t)set_bits(target[k * step + j] ^ word);
      bits[j] = k > 0 ? bits[j] + more : more;
    }
  }
}

// List those of a block with fewer bits than some; return how many there are by then.
INLINE Py_ssize_t list_fewer(const uint64_t *bits, uint64_t bound, Py_ssize_t first,
                             Py_ssize_t end, int64_t *found, Py_ssize_t count) {
  uint64_t any = 0;
#pragma GCC unroll 1
  for (int j = 0; j < BLOCK; ++j)
    any |= bits[j] < bound;
  for (Py_ssize_t j = 0; any && j < BLOCK && first + j < end; ++j) {
    found[count] = first + j;
    count += bits[j] < bound;
  }
  return count;
}

// The number of bits of which fewer make a distance below a bound.
static uint64_t bits_below(float bound, Py_ssize_t width) {
  const float unit = fraction(width);
  const uint64_t most = 8 * (uint64_t)width;
  uint64_t low = 0, high = most + 1;  // the bits are not more than high, and not less than low
  while (low < high) {
    const uint64_t middle = (low + high) / 2;
    if (middle <= most && (float)middle * unit < bound)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

// List the targets with fewer bits than some that differ from a source; there is room for them.
WHERE_BITS_ARE_COUNTED_TOGETHER
static Py_ssize_t list_similar(const Words *target, const Descriptors *d,
                               const unsigned char *source, uint64_t bound, int64_t *found) {
  const Py_ssize_t width = d->width;
  Py_ssize_t count = 0;
  for (Py_ssize_t first = 0; first < d->target_count; first += BLOCK) {
    uint64_t bits[BLOCK];
    const uint64_t *words = target->words + first;
    if (width == ORB)  // faster where the compiler knows it
      count_bits(words, target->step, ORB / WORD, source, ORB, bits);
    else
      count_bits(words, target->step, target->per_descriptor, source, width, bits);
    count = list_fewer(bits, bound, first, d->target_count, found, count);
  }
  return count;
}

// List the pairs with a distance below a bound, many at once; false without memory.
static bool list_together(const Descriptors *d, float bound, Pairs *pairs) {
  const uint64_t bits = bits_below(bound, d->width);
  const Words target = words_of(d);
  int64_t *found = malloc((size_t)(d->target_count + 1) * sizeof(*found));
  bool is_complete = target.words != NULL && found != NULL;
  for (Py_ssize_t i = 0; i < d->source_count && is_complete; ++i)
    is_complete = add_targets(
        pairs, i, found, list_similar(&target, d, d->source + i * d->width, bits, found));
  free(target.words);
  free(found);
  return is_complete;
}

// The same one by one, which takes less where a processor does not count them together.
static bool list_singly(const Descriptors *d, float bound, Pairs *pairs) {
  float *distances = malloc((size_t)(d->target_count + 1) * sizeof(*distances));
  bool is_complete = distances != NULL;
  for (Py_ssize_t i = 0; i < d->source_count && is_complete; ++i) {
    compare_to_all(d, i, distances);
    is_complete = add_below(pairs, i, distances, d->target_count, bound);
  }
  free(distances);
  return is_complete;
}

PyObject *kernel_bit_distances(PyObject *module, PyObject *arguments) {
  PyObject *source_array, *target_array, *distance_array;
  Descriptors d;
  if (!PyArg_ParseTuple(arguments, "OOnO", &source_array, &target_array, &d.width,
                        &distance_array) ||
      !has_counts(&d, source_array, target_array))
    return NULL;
  const Argument needed[] = {
      {"the source", source_array, 'B', d.source_count * d.width, false},
      {"the target", target_array, 'B', d.target_count * d.width, false},
      {"the distances", distance_array, 'f', d.source_count * d.target_count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  d.source = arrays.views[0].buf;
  d.target = arrays.views[1].buf;
  float *distances = arrays.views[2].buf;
  Py_BEGIN_ALLOW_THREADS
  for (Py_ssize_t i = 0; i < d.source_count; ++i)
    compare_to_all(&d, i, distances + d.target_count * i);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  Py_RETURN_NONE;
}

PyObject *kernel_bit_distances_of_pairs(PyObject *module, PyObject *arguments) {
  PyObject *source_array, *target_array, *source_row_array, *target_row_array, *distance_array;
  Descriptors d;
  if (!PyArg_ParseTuple(arguments, "OOnOOO", &source_array, &target_array, &d.width,
                        &source_row_array, &target_row_array, &distance_array) ||
      !has_counts(&d, source_array, target_array))
    return NULL;
  const Py_ssize_t count = row_count(distance_array);
  const Argument needed[] = {
      {"the source", source_array, 'B', d.source_count * d.width, false},
      {"the target", target_array, 'B', d.target_count * d.width, false},
      {"the rows of the source", source_row_array, 'q', count, false},
      {"the rows of the target", target_row_array, 'q', count, false},
      {"the distances", distance_array, 'f', count, true},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  d.source = arrays.views[0].buf;
  d.target = arrays.views[1].buf;
  const int64_t *source_rows = arrays.views[2].buf, *target_rows = arrays.views[3].buf;
  float *distances = arrays.views[4].buf;
  bool are_rows;
  Py_BEGIN_ALLOW_THREADS
  are_rows = compare_pairs(&d, source_rows, target_rows, count, distances);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  if (!are_rows) {
    PyErr_SetString(PyExc_ValueError, "a row of a pair is not one of the descriptors");
    return NULL;
  }
  Py_RETURN_NONE;
}

PyObject *kernel_pairs_of_similar_bits(PyObject *module, PyObject *arguments) {
  PyObject *source_array, *target_array;
  Descriptors d;
  float bound;
  if (!PyArg_ParseTuple(arguments, "OOnf", &source_array, &target_array, &d.width, &bound) ||
      !has_counts(&d, source_array, target_array))
    return NULL;
  const Argument needed[] = {
      {"the source", source_array, 'B', d.source_count * d.width, false},
      {"the target", target_array, 'B', d.target_count * d.width, false},
  };
  Arrays arrays;
  if (!open_arrays(&arrays, needed, COUNT(needed)))
    return NULL;
  d.source = arrays.views[0].buf;
  d.target = arrays.views[1].buf;
  Pairs pairs = {0};
  bool is_complete;
  Py_BEGIN_ALLOW_THREADS
  is_complete = ARE_BITS_COUNTED_TOGETHER ? list_together(&d, bound, &pairs)
                                          : list_singly(&d, bound, &pairs);
  Py_END_ALLOW_THREADS
  close_arrays(&arrays);
  return take_pairs(&pairs, is_complete);
}
