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
typedef float Quads __attribute__((vector_size(FOUR * sizeof(float))));
typedef int32_t Integers __attribute__((vector_size(EIGHT * sizeof(int32_t))));
typedef double Doubles __attribute__((vector_size(FOUR * sizeof(double))));
typedef int64_t Masks __attribute__((vector_size(FOUR * sizeof(int64_t))));
typedef int16_t Shorts __attribute__((vector_size(EIGHT * sizeof(int16_t))));
typedef uint16_t UnsignedShorts __attribute__((vector_size(EIGHT * sizeof(uint16_t))));
typedef uint8_t Bytes __attribute__((vector_size(EIGHT)));

// Pixels, and whole numbers, are made wider one by one: so compilers find one instruction for all.
INLINE Shorts load_pixels(const uint8_t *p) {
  return (Shorts){p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]};
}

INLINE Integers to_integers(Shorts s) {
  return (Integers){s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7]};
}

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
