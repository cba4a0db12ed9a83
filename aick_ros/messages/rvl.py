# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
RVL data to depth images (Wilson, Fast Lossless Depth Image Compression, ISS 2017).

The pixels, row by row, are runs: the number of zeros, the number of other pixels, and their
differences from the previous non-zero pixel, zigzag coded: 0 for 0, 1 for -1, 2 for 1, 3 for -2
and so on. Each number is written in digits of three bits, the lowest first, each with a fourth
bit that is set where another digit follows. Eight digits fill a 32-bit word from its highest bit.
"""

from __future__ import annotations

import numpy as np

from aick_ros.borders.limits import MAX_RVL_PIXELS
from aick_ros.errors import InputError

_MOST_DIGITS = 9  # of a number; derived: keeps it below 2^31
_MOST_BYTES = 3  # for each pixel; derived: six digits for a difference of 17 bits
_FILL = 64  # bytes beyond the last pixel, and of the lengths of the runs; chosen


def decode_rvl(data: bytes, width: int, height: int) -> np.ndarray:
    """
    Return the image in RVL data.

    :param data: without the image size, which each transport sends in its own way.
    :param width: image columns [px]; ``height``: image rows [px].
    :returns: HxW uint16.
    :raises InputError: where the data is truncated or damaged.
    """
    if not (width > 0 and height > 0 and width * height <= MAX_RVL_PIXELS):
        raise InputError(f'its RVL data is declared as {width} x {height} pixels, so it is '
                         'damaged: record it again')
    if len(data) > _MOST_BYTES * width * height + _FILL:
        raise InputError(f'its {len(data)} bytes of RVL data are more than {width} x {height} '
                         'pixels can have, so it is damaged: record it again')
    numbers = _numbers(_digits(data))
    heads = _heads_of_runs(numbers, width * height)
    lengths = numbers[np.stack([heads, heads + 1], axis=1)].ravel()
    end = heads[-1] + 2 + lengths[-1]
    is_difference = np.ones(end, bool)
    is_difference[heads] = is_difference[heads + 1] = False
    zigzag = numbers[:end][is_difference]
    image = np.zeros(width * height, np.uint16)
    is_stored = np.repeat(np.tile([False, True], len(heads)), lengths)
    # the differences are taken modulo 2^16
    image[is_stored] = np.cumsum((zigzag >> 1) ^ -(zigzag & 1), dtype=np.uint16)
    return image.reshape(height, width)


def _digits(data: bytes) -> np.ndarray:
    """Return the digits in order, N uint8: three bits, and 8 where another one follows."""
    words = np.frombuffer(data, '<u4', len(data) // 4)
    high_byte_first = words.astype('>u4').view(np.uint8)
    return np.stack([high_byte_first >> 4, high_byte_first & 15], axis=1).ravel()


def _numbers(digits: np.ndarray) -> np.ndarray:
    """Return the complete numbers, N int32."""
    last = np.flatnonzero(digits < 8)
    if not len(last):
        return np.empty(0, np.int32)
    counts = np.diff(last, prepend=-1)
    if counts.max() > _MOST_DIGITS:
        raise _unreadable('damaged')
    numbers = digits[last].astype(np.int32)
    for i in range(1, counts.max()):
        longer = np.flatnonzero(counts > i)
        numbers[longer] = 8 * numbers[longer] + (digits[last[longer] - i] & 7)
    return numbers


def _heads_of_runs(numbers: np.ndarray, pixels: int) -> np.ndarray:
    """Return the index of the two lengths of each run in the numbers, N int."""
    heads, head, left = [], 0, pixels
    while left > 0:
        if head + 1 >= len(numbers):
            raise _unreadable('truncated')
        heads.append(head)
        others = numbers.item(head + 1)
        length = numbers.item(head) + others
        if not length:
            raise _unreadable('damaged')
        left -= length
        head += 2 + others
    if left < 0:
        raise _unreadable('damaged')
    if head > len(numbers):
        raise _unreadable('truncated')
    return np.array(heads)


def _unreadable(state: str) -> InputError:
    return InputError(f'its RVL data is {state}: record it again, or have the publisher send PNG '
                      '(its parameter compressedDepth.format)')
