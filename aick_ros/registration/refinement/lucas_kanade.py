# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracking of pixels from one image to another and back (Lucas and Kanade 1981, Bouguet 2001)."""

from __future__ import annotations

import cv2
import numpy as np

_CRITERIA = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.03)  # chosen [-, px]
_MAX_RETURN_ERROR = 0.5  # px; chosen: distance from the start after tracking there and back


def track_there_and_back(before: np.ndarray, now: np.ndarray, pixels: np.ndarray, window: int,
                         levels: int, expected: np.ndarray | None = None
                         ) -> tuple[np.ndarray, np.ndarray]:
    """
    Track pixels from one image to another, and keep those that track back to their start.

    With an expected place the search there starts from it. The search back then starts from the
    original pixel, at full resolution only.

    :param before: HxW uint8.
    :param now: HxW uint8.
    :param pixels: Nx2 float32 in ``before``, N may be 0.
    :param window: side of the tracked window [px].
    :param levels: levels of the image pyramid above full resolution.
    :param expected: Nx2 float32, about where the pixels are in ``now``; None: unknown.
    :returns: Nx2 float32, the pixels in ``now``, and N bool, whether each was found.
    """
    if not len(pixels):
        return np.empty((0, 2), np.float32), np.empty(0, bool)
    seen, found = _track(before, now, pixels, window, levels, expected)
    if expected is None:
        returned, found_again = _track(now, before, seen, window, levels, None)
    else:
        returned, found_again = _track(now, before, seen, window, 0, pixels)
    u, v = np.abs(returned - pixels).T
    return seen, found & found_again & (np.maximum(u, v) < _MAX_RETURN_ERROR)


def _track(before: np.ndarray, now: np.ndarray, pixels: np.ndarray, window: int, levels: int,
           start: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels in the other image, Nx2, and whether each was found, N bool."""
    guess = (pixels if start is None else start).reshape(-1, 1, 2).copy()
    # the eigenvalues take no time: the errors, which nobody needs either, take a tenth
    flags = cv2.OPTFLOW_LK_GET_MIN_EIGENVALS
    if start is not None:
        flags |= cv2.OPTFLOW_USE_INITIAL_FLOW
    seen, status, _ = cv2.calcOpticalFlowPyrLK(
        before, now, pixels.reshape(-1, 1, 2), guess, winSize=(window, window), maxLevel=levels,
        criteria=_CRITERIA, flags=flags)
    return seen.reshape(-1, 2), status.ravel() > 0
