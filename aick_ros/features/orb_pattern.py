# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Descriptors of ORB: those of OpenCV, in less time.

Each bit compares two pixels beside a keypoint. Which ones they are was learned from images and
comes with OpenCV: it is read off its descriptors of keypoints beside edges, once per process.
Where descriptors that are made by it are not those of OpenCV, OpenCV makes all of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from aick_ros import kernels
from aick_ros.features.mirrored_border import with_border

_BITS = 256  # of a descriptor
_BLURRED = 3  # by definition of OpenCV: radius of the blur of what is compared [px]
_LEAST_BORDER = 20  # by definition of the kernel [px]
_TELLING = 104951  # of random images, one where fused sums make another descriptor


@dataclass(frozen=True)
class Pattern:
    """Pixel pairs compared by a descriptor: a bit is set where the second one is brighter."""

    coordinates: np.ndarray
    """4x256 float32, x and y of the first, x and y of the second one, from the keypoint [px]."""
    fused: bool
    """Fused multiply-add in the blur, as newer processors have: one rounding instead of two."""


def least_border(patch_size: int) -> int:
    """Return how far beyond an image its border has to reach [px], for patches of a side [px]."""
    return max(math.ceil(patch_size // 2 * math.sqrt(2.0)), _LEAST_BORDER)


def describe(image: np.ndarray, border: int, patch_size: int, points: np.ndarray,
             directions: np.ndarray) -> np.ndarray:
    """
    Return the descriptors of points, Kx32 uint8, one at least.

    :param image: HxW uint8, with a mirrored border around it; it is blurred around the points.
    :param border: its width [px].
    :param patch_size: side of what is described [px].
    :param points: Kx2 float32, whole pixels within the border.
    :param directions: K, 0 to 360 [deg].
    """
    found = pattern(patch_size)
    if found is not None:
        return _by_kernel(image, border, found, points, directions)
    return _by_opencv(image[border:-border, border:-border], patch_size, points, directions)


@cache
def pattern(patch_size: int) -> Pattern | None:
    """Return the pattern of OpenCV's descriptors; none if they are not made by one."""
    image = np.random.RandomState(_TELLING).randint(0, 256, (64, 64), np.uint8)
    places = np.arange(0, 64, 2, dtype=np.float32)
    points = np.stack(np.meshgrid(places, places), axis=-1).reshape(-1, 2)
    directions = 47.3 * np.arange(len(points)) % 360.0
    expected = _by_opencv(image, patch_size, points, directions)
    border = least_border(patch_size)
    coordinates = _coordinates(patch_size)
    for fused in (False, True):
        found = Pattern(coordinates, fused)
        descriptors = _by_kernel(with_border(image, border), border, found, points, directions)
        if (descriptors == expected).all():
            return found
    return None


def _by_kernel(image: np.ndarray, border: int, found: Pattern, points: np.ndarray,
               directions: np.ndarray) -> np.ndarray:
    """Return the descriptors of points by a pattern."""
    descriptors = np.empty((len(points), _BITS // 8), np.uint8)
    kernels.describe_points(image, border, found.coordinates, found.fused, points, directions,
                            descriptors)
    return descriptors


def _by_opencv(image: np.ndarray, patch_size: int, points: np.ndarray,
               directions: np.ndarray) -> np.ndarray:
    """Return OpenCV's descriptors of points of an image without a border."""
    describer = cv2.ORB_create(  # type: ignore[attr-defined]  # missing in the stubs
        nlevels=1, edgeThreshold=0, WTA_K=2, patchSize=patch_size)
    keypoints = [cv2.KeyPoint(x, y, patch_size, direction)
                 for (x, y), direction in zip(points.tolist(), directions.tolist())]
    descriptors: np.ndarray = describer.compute(image, keypoints)[1]
    return descriptors


def _coordinates(patch_size: int) -> np.ndarray:
    """
    Measure the coordinates of a pattern.

    An upright edge between the columns of two pixels sets the bit if it is the second one that is
    beyond it. Of pixels of one column, four quarters show where that is: which of the pixels is
    the brighter one changes there. The same goes for rows.
    """
    reach = patch_size // 2 + _BLURRED
    edges, middle = np.arange(-reach, reach + 1), 2 * reach
    beyond = np.arange(2 * middle) >= middle

    def bits(is_bright: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return what points see that have an edge at (x, y) from them, Kx256 bool."""
        image = np.where(is_bright, 255, np.zeros(2 * [2 * middle])).astype(np.uint8)
        points = (middle - np.stack([x.ravel(), y.ravel()], axis=1)).astype(np.float32)
        return np.unpackbits(_by_opencv(image, patch_size, points, np.zeros(len(points))),
                             axis=1, bitorder='little').astype(bool)

    nowhere = np.zeros_like(edges)
    x, x_differs = _ends(edges, bits(beyond, edges, nowhere), bits(~beyond, edges, nowhere))
    y, y_differs = _ends(edges, bits(beyond[:, None], nowhere, edges),
                         bits(~beyond[:, None], nowhere, edges))
    rows, columns = np.meshgrid(edges, edges, indexing='ij')
    quarters = bits(beyond ^ beyond[:, None], columns, rows).reshape(*rows.shape, _BITS)
    every = np.arange(_BITS)
    x = np.where(x_differs, x, _change(edges, quarters[y.max(axis=0) + reach, :, every]))
    y = np.where(y_differs, y, _change(edges, quarters[:, x.max(axis=0) + reach, every].T))
    is_compared = x_differs | y_differs  # others: a pixel with itself
    return np.where(is_compared, (x[0], y[0], x[1], y[1]), 0).astype(np.float32)


def _ends(edges: np.ndarray, brighter_beyond: np.ndarray,
          darker_beyond: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """
    Return the coordinates along one axis of what is compared, 2x256, and whether they differ.

    :param edges: K, from the keypoint [px].
    :param brighter_beyond: Kx256, the bits at edges that are followed by what is brighter.
    :param darker_beyond: Kx256, at the others.
    """
    either = brighter_beyond | darker_beyond
    least = edges[either.argmax(axis=0)] + _BLURRED - 1
    greatest = edges[::-1][either[::-1].argmax(axis=0)] - _BLURRED
    ends = np.where(brighter_beyond.any(axis=0), (least, greatest), (greatest, least))
    return ends, either.any(axis=0)


def _change(edges: np.ndarray, bits: np.ndarray) -> np.ndarray:
    """Return the edge, one of K, after which the first of 256xK bits is another one, 256."""
    found: np.ndarray = edges[(bits[:, 1:] != bits[:, :-1]).argmax(axis=1)]
    return found
