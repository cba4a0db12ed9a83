// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Code for what newer processors can do.

#ifndef AICK_ROS_PROCESSORS_H
#define AICK_ROS_PROCESSORS_H

// Compiles a function twice: for every processor, and for x86-64 of 2013 and later, which counts
// bits and computes eight floats at once; the digits are the same. Loading chooses one.
// The second one is for functions that round a product and its sum at once: of the two, one is for
// processors that do so.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx2", "default")))
#define FOR_EACH_FUSING_PROCESSOR __attribute__((target_clones("fma", "default")))
#else
#define FOR_EACH_PROCESSOR
#define FOR_EACH_FUSING_PROCESSOR
#endif

#endif
