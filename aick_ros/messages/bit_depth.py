# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Number of bits that a camera uses of the 16 of its images."""

from __future__ import annotations

import numpy as np

_BITS = 10, 12, 14, 16  # by definition: those of the converters in cameras


class BitDepth:
    """
    Bits of a camera, of which an image of 16 bits says only that they are not more.

    Many drivers send the 10 or 12 bits of a camera as they are: such an image has no value above
    1023 or 4095, which is nearly black. The bits are the fewest that all images until now have
    had room in, so that they change at most three times, however dark an image is.
    """

    def __init__(self) -> None:
        self._bits = min(_BITS)

    def full_range(self, samples: np.ndarray) -> np.ndarray:
        """
        Return the samples of the next image, multiplied so that the brightest may be 65535.

        :param samples: uint16, of any shape and byte order.
        """
        largest = int(samples.max(initial=0))
        self._bits = next(bits for bits in _BITS
                          if bits >= self._bits and largest < 1 << bits)
        shift = max(_BITS) - self._bits
        return np.left_shift(samples, shift) if shift else samples
