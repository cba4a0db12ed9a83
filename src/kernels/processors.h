// SPDX-FileCopyrightText: 2026 The aick_ros authors
// SPDX-License-Identifier: Apache-2.0

// Code for what newer processors can do.

#ifndef AICK_ROS_PROCESSORS_H
#define AICK_ROS_PROCESSORS_H

// FOR_EACH_PROCESSOR compiles a function twice: for every processor, and for x86-64 of 2013 and
// later, which counts bits and computes eight floats at once; the digits are the same. Loading
// chooses one. FOR_EACH_FUSING_PROCESSOR does so for functions that round a product and its sum at
// once: one is for processors that can. WHERE_BITS_ARE_COUNTED_TOGETHER compiles one for those of
// 2019 and later that count the bits of eight words at once, to be called where they are.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__)
#define FOR_EACH_PROCESSOR __attribute__((target_clones("avx2", "default")))
#define FOR_EACH_FUSING_PROCESSOR __attribute__((target_clones("fma", "default")))
#define WHERE_BITS_ARE_COUNTED_TOGETHER __attribute__((target("avx512vpopcntdq")))
#define ARE_BITS_COUNTED_TOGETHER __builtin_cpu_supports("avx512vpopcntdq")
#else
#define FOR_EACH_PROCESSOR
#define FOR_EACH_FUSING_PROCESSOR
#define WHERE_BITS_ARE_COUNTED_TOGETHER
#define ARE_BITS_COUNTED_TOGETHER false
#endif

#endif
