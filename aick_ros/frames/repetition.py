# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images that a driver delivers again under a new stamp."""

from __future__ import annotations

from enum import Enum

import numpy as np

from aick_ros.frames.rgbd import RgbdFrame


class Repeat(Enum):
    """
    Images of a frame that are those of the frame before, to the last bit.

    A sensor has noise: even at rest its images differ.
    """

    NONE = 'no image repeats'
    COLOUR = 'the colour image repeats'
    DEPTH = 'the depth image repeats'
    BOTH = 'both images repeat'


def repeat_of(frame: RgbdFrame, before: RgbdFrame) -> Repeat:
    """
    Return which images of a frame are those of the frame before.

    An image that shows nothing is like all others of a covered lens: alone it repeats nothing.
    """
    colour = are_equal(frame.colour, before.colour)
    # as bits: NaN differs from itself
    bits = frame.depth.view(np.int32)
    depth = are_equal(bits, before.depth.view(np.int32))
    of_colour = colour and _shows_something(frame.colour)
    of_depth = depth and _shows_something(bits)
    if colour and depth and (of_colour or of_depth):
        return Repeat.BOTH
    if of_colour:
        return Repeat.COLOUR
    return Repeat.DEPTH if of_depth else Repeat.NONE


def _shows_something(image: np.ndarray) -> bool:
    return bool(image.min() != image.max())


def are_equal(image: np.ndarray, other: np.ndarray) -> bool:
    """Return whether two images are equal."""
    if image.shape != other.shape:
        return False
    middle = len(image) // 2  # one row differs in almost all different images
    return (image[middle].tobytes() == other[middle].tobytes()
            and np.array_equal(image, other))
