// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Eight or four numbers side by side: vectors of GCC and Clang, for every processor.

#ifndef AICK_ROS_LANES_H
#define AICK_ROS_LANES_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { FOUR = 4, EIGHT = 8 };

// Functions of lanes are inlined: no call passes them alike on all processors.
#define INLINE static inline __attribute__((always_inline))
#pragma GCC diagnostic ignored "-Wpsabi"

typedef float Floats __attribute__((vector_size(EIGHT * sizeof(float))));
typedef int32_t Integers __attribute__((vector_size(EIGHT * sizeof(int32_t))));
typedef double Doubles __attribute__((vector_size(FOUR * sizeof(double))));
typedef int64_t Masks __attribute__((vector_size(FOUR * sizeof(int64_t))));
typedef int16_t Shorts __attribute__((vector_size(EIGHT * sizeof(int16_t))));
typedef uint16_t UnsignedShorts __attribute__((vector_size(EIGHT * sizeof(uint16_t))));
typedef uint8_t Bytes __attribute__((vector_size(EIGHT)));

INLINE Shorts load_pixels(const uint8_t *pixels) {
  Bytes bytes;
  memcpy(&bytes, pixels, sizeof(bytes));
  return __builtin_convertvector(bytes, Shorts);
}

INLINE Integers to_integers(Shorts shorts) { return __builtin_convertvector(shorts, Integers); }

INLINE Floats to_floats(Integers integers) { return __builtin_convertvector(integers, Floats); }

// The nearest integers of numbers below 2^22, and the even ones of two that are as near.
INLINE Integers rounded(Floats numbers) {
  const Floats shifted = numbers + 12582912.0f;  // to where neighbours differ by one
  Integers bits;
  memcpy(&bits, &shifted, sizeof(bits));
  return bits - 0x4b400000;  // the bits of what was added
}

INLINE Floats load(const float *numbers) {
  Floats floats;
  memcpy(&floats, numbers, sizeof(floats));
  return floats;
}

INLINE void store(Floats floats, float *numbers) { memcpy(numbers, &floats, sizeof(floats)); }

// Lanes of the first one where a mask has all bits set, of the second one where it has none.
INLINE Doubles chosen(Masks mask, Doubles one, Doubles other) {
  return (Doubles)((mask & (Masks)one) | (~mask & (Masks)other));
}

INLINE bool are_all(Masks mask) { return (mask[0] & mask[1] & mask[2] & mask[3]) != 0; }

#endif
