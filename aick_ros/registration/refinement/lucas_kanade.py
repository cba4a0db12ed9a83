# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracking of pixels from one image to another and back (Lucas and Kanade 1981, Bouguet 2001)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from aick_ros import kernels
from aick_ros.features.mirrored_border import with_border

_MAX_RETURN_ERROR = 0.5  # px; chosen: distance from the start after tracking there and back
_LAST_STEP = 0.03  # px; chosen: a window is found where a step towards it is as small
_COARSE_STEP = 0.1  # px; chosen: where it is looked for again, or need not be known that well
_SPARE = 16  # by definition of the kernel: pixels that it reads beyond a window


@dataclass(frozen=True, eq=False)
class Pyramid:
    """
    An image at full resolution, at half of it, and so on, with borders to be tracked in.

    :param levels: images, uint8.
    :param border: width of their borders [px].
    :param window: side of the window that is tracked [px].
    """

    levels: list[np.ndarray]
    border: int
    window: int

    @classmethod
    def of(cls, image: np.ndarray, window: int, levels: int) -> Pyramid:
        """
        Return the pyramid of an HxW uint8 image.

        :param levels: above full resolution; fewer where the image becomes as small as a window.
        """
        images = [image]
        while len(images) <= levels and min(images[-1].shape) > 2 * window:
            images.append(np.asarray(cv2.pyrDown(images[-1])))
        border = window + _SPARE
        return cls([with_border(level, border) for level in images], border, window)


def track_there_and_back(before: Pyramid, now: Pyramid, pixels: np.ndarray,
                         expected: np.ndarray | None = None, turns: np.ndarray | None = None
                         ) -> tuple[np.ndarray, np.ndarray]:
    """
    Track pixels from one image to another, and keep those that track back to their start.

    With an expected place the search there starts from it. The search back then starts from the
    original pixel, at full resolution only.

    :param before: pyramid of one image.
    :param now: of the other one, as large, for the same window.
    :param pixels: Nx2 float32 in ``before``, N may be 0.
    :param expected: Nx2 float32, about where the pixels are in ``now``; None: unknown.
    :param turns: Nx2x2 float64, how the windows around them are turned and stretched until they
        are seen in ``now``: derivatives of places there by those in ``before``; None: not at all.
    :returns: Nx2 float32, the pixels in ``now``, and N bool, whether each was found.
    """
    if not len(pixels):
        return np.empty((0, 2), np.float32), np.empty(0, bool)
    levels = len(before.levels)
    turns = not_turned(len(pixels)) if turns is None else turns
    seen, found = _track(before, now, pixels, pixels if expected is None else expected,
                         inverted(turns), levels, _LAST_STEP)
    start, levels = (seen, levels) if expected is None else (pixels, 1)
    returned, found_again = _track(now, before, seen, start, turns, levels, _COARSE_STEP)
    u, v = np.abs(returned - pixels).T
    return seen, found & found_again & (np.maximum(u, v) < _MAX_RETURN_ERROR)


def not_turned(count: int) -> np.ndarray:
    """Return the turns of windows that are seen as they are, Nx2x2."""
    turns = np.zeros((count, 2, 2))
    turns[:, 0, 0] = turns[:, 1, 1] = 1.0
    return turns


def inverted(turns: np.ndarray) -> np.ndarray:
    """Return the turns back, Nx2x2; inf or NaN where there is none."""
    (uu, uv), (vu, vv) = turns.transpose(1, 2, 0)
    with np.errstate(divide='ignore', invalid='ignore'):
        back = np.array([[vv, -uv], [-vu, uu]]) / (uu * vv - uv * vu)
    return np.ascontiguousarray(back.transpose(2, 0, 1))


def _track(before: Pyramid, now: Pyramid, pixels: np.ndarray, start: np.ndarray,
           lattices: np.ndarray, levels: int,
           last_step: float) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the pixels in the other image, Nx2, and whether each was found, N bool.

    :param lattices: Nx2x2, derivatives of places in ``before`` by those in ``now``.
    :param last_step: how small the last step of a window is [px].
    """
    places, found = start.copy(), np.empty(len(pixels), bool)
    for level in reversed(range(levels)):
        scale = np.float32(0.5 ** level)
        places *= scale
        kernels.align_windows(before.levels[level], now.levels[level], before.border,
                              before.window, last_step if level == 0 else _COARSE_STEP,
                              pixels * scale, lattices, places, found)
        places /= scale
    return places, found
