# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracking of pixels from one image to another and back (Lucas and Kanade 1981, Bouguet 2001)."""

from __future__ import annotations

import numpy as np

from aick_ros import kernels
from aick_ros.features.mirrored_border import with_border

_MAX_RETURN_ERROR = 0.5  # px; chosen: distance from the start after tracking there and back
_LAST_STEP = 0.03  # px; chosen: a window is found where a step towards it is as small
_COARSE_STEP = 0.1  # px; chosen: where it is looked for again, or need not be known that well
_EXPECTED_WIDTH = 400
"""Width of the images from which on pixels are sought where they are expected [px].

Chosen on two excerpts of real recordings: there a level more finds a tenth more in one frame of
thirty, those in which the camera turns as it was not expected to."""

_MOST_FOUND = 0.6  # chosen: share of the pixels below which they are sought further away
_SPARE = 16  # by definition of the kernel: pixels that it reads beyond a window


class Pyramid:
    """
    An image at full resolution, at half of it, and so on, with borders to be tracked in.

    Levels are made where they are first asked for.

    :param image: HxW uint8.
    :param window: side of the window that is tracked [px].
    :param levels: above full resolution; fewer where the image becomes as small as a window.
    """

    def __init__(self, image: np.ndarray, window: int, levels: int) -> None:
        self.window = window
        self.border = window + _SPARE
        """Width of the borders [px]."""
        self._levels = [with_border(image, self.border)]
        self.sizes = [image.shape]
        """Height and width of the image of each level, without borders."""
        while len(self.sizes) <= levels and min(self.sizes[-1]) > 2 * window:
            height, width = self.sizes[-1]
            self.sizes.append(((height + 1) // 2, (width + 1) // 2))

    def level(self, number: int) -> np.ndarray:
        """Return the image of a level, uint8; 0 is full resolution."""
        if number == 0:  # most are
            return self._levels[0]
        while len(self._levels) <= number:
            height, width = self.sizes[len(self._levels)]
            level = np.empty((height + 2 * self.border, width + 2 * self.border), np.uint8)
            kernels.halve(self._levels[-1], self.border, level)
            self._levels.append(level)
        return self._levels[number]


def track_there_and_back(before: Pyramid, now: Pyramid, pixels: np.ndarray,
                         expected: np.ndarray | None = None, warps: np.ndarray | None = None,
                         is_near: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """
    Track pixels from one image to another, and keep those that track back to their start.

    With an expected place the search there starts from it, at a level that reaches as far as most
    expectations err; where fewer pixels are found, all are sought again from the coarsest one. The
    search back then starts from the original pixel, at full resolution only.

    :param before: pyramid of one image.
    :param now: of the other one, as large, for the same window.
    :param pixels: Nx2 float32 in ``before``, N may be 0.
    :param expected: Nx2 float32, about where the pixels are in ``now``; None: unknown.
    :param warps: Nx2x2 float64, how the windows around them turn and stretch until they
        are seen in ``now``: derivatives of places there by those in ``before``; None: not at all.
    :param is_near: whether they are as near to it as a window is wide: sought in ``now`` itself.
    :returns: Nx2 float32, the pixels in ``now``, and N bool, whether each was found.
    """
    pixels = np.ascontiguousarray(pixels)
    levels = len(before.sizes)
    if expected is not None:
        first = 1 if is_near else _levels_expected(before)
        seen, found = _track_twice(before, now, pixels, expected, warps, first)
        if is_near or first == levels or np.count_nonzero(found) >= _MOST_FOUND * len(found):
            return seen, found
    return _track_twice(before, now, pixels, expected, warps, levels)


def track_coarsely(before: Pyramid, now: Pyramid, pixels: np.ndarray, expected: np.ndarray,
                   warps: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """
    Track pixels from one image to another, from the coarsest level to half of the resolution.

    Parameters and results as of :func:`track_there_and_back`; nothing is tracked back.
    """
    levels = len(before.sizes)
    return _track(before, now, pixels, expected, inverted(warps),
                  range(min(1, levels - 1), levels), _COARSE_STEP)


def _levels_expected(pyramid: Pyramid) -> int:
    """Return the number of levels that pixels are sought in at first, where one is expected."""
    fewest, levels = 2, len(pyramid.sizes)
    return next((count for count in range(fewest, levels)
                 if pyramid.sizes[count - 1][1] <= _EXPECTED_WIDTH), levels)


def _track_twice(before: Pyramid, now: Pyramid, pixels: np.ndarray, expected: np.ndarray | None,
                 warps: np.ndarray | None, levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Track pixels there and back, once; parameters as of :func:`track_there_and_back`."""
    if not len(pixels):
        return np.empty((0, 2), np.float32), np.empty(0, bool)
    seen, found = _track(before, now, pixels, pixels if expected is None else expected,
                         inverted(warps), range(levels), _LAST_STEP)
    start, levels = (seen, levels) if expected is None else (pixels, 1)
    returned, found_again = _track(now, before, seen, start, warps, range(levels), _COARSE_STEP)
    both = np.flatnonzero(found & found_again)  # the others may be nowhere
    u, v = np.abs(returned.take(both, axis=0) - pixels.take(both, axis=0)).T
    is_back = np.zeros(len(pixels), bool)
    is_back[both] = np.maximum(u, v) < _MAX_RETURN_ERROR
    return seen, is_back


def inverted(warps: np.ndarray | None) -> np.ndarray | None:
    """Return the warps back, Nx2x2; inf or NaN where there is none; None of None."""
    if warps is None:
        return None
    back = np.empty((len(warps), 2, 2))
    kernels.inverted_warps(warps, back)
    return back


def _track(before: Pyramid, now: Pyramid, pixels: np.ndarray, start: np.ndarray,
           lattices: np.ndarray | None, levels: range,
           last_step: float) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the pixels in the other image, Nx2, and whether each was found, N bool.

    :param lattices: Nx2x2, derivatives of places in ``before`` by those in ``now``; None: unity.
    :param levels: of the pyramids; the last one is the coarsest.
    :param last_step: how small the last step of a window is at full resolution [px].
    """
    places, found = start.copy(), np.empty(len(pixels), bool)
    for level in reversed(levels):
        kernels.align_windows(before.level(level), now.level(level), before.border,
                              before.window, last_step if level == 0 else _COARSE_STEP,
                              0.5 ** level, pixels, lattices, places, found)
    return places, found
