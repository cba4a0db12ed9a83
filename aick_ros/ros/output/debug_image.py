# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A picture of the keypoints and matches of a frame."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.odometry import OdometryUpdate

_KEYPOINT, _MATCH, _LOST = (255, 180, 0), (0, 220, 90), (230, 40, 40)  # red, green, blue
_SUBPIXEL_BITS = 3
_TEXT_HEIGHT = 16  # px


def draw_matches(colour: np.ndarray, update: OdometryUpdate) -> np.ndarray:
    """
    Return the image with its keypoints, and a line to the match of each in the reference.

    :param colour: HxWx3 or HxW uint8, the image of the update; it is not changed.
    :returns: HxWx3 uint8 (red, green, blue).
    """
    picture = cv2.cvtColor(colour, cv2.COLOR_GRAY2RGB) if colour.ndim == 2 else colour.copy()
    pixels = _fixed_point(update.keypoints.pixels)
    for centre in pixels:
        _dot(picture, centre, _KEYPOINT)
    if update.reference is not None:
        source, target = update.matches.T
        lines = np.stack([_fixed_point(update.reference.pixels[target]), pixels[source]], axis=1)
        cv2.polylines(picture, list(lines), False, _MATCH, 1, cv2.LINE_AA, _SUBPIXEL_BITS)
        for centre in pixels[source]:
            _dot(picture, centre, _MATCH)
    _caption(picture, f'{update.status.value}: {update.reason}',
             _MATCH if update.status.ok else _LOST)
    return picture


def _fixed_point(pixels: np.ndarray) -> np.ndarray:
    fixed_point: np.ndarray = np.rint(pixels * 2 ** _SUBPIXEL_BITS).astype(np.int32)
    return fixed_point


def _dot(picture: np.ndarray, centre: np.ndarray, colour: tuple[int, int, int]) -> None:
    cv2.circle(picture, centre.tolist(), 2 << _SUBPIXEL_BITS, colour, 1, cv2.LINE_AA,
               _SUBPIXEL_BITS)


def _caption(picture: np.ndarray, text: str, colour: tuple[int, int, int]) -> None:
    picture[-_TEXT_HEIGHT:] //= 4
    origin = (4, picture.shape[0] - 4)
    cv2.putText(picture, text, origin, cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)
