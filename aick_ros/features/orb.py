# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
ORB keypoints (Rublee et al. 2011), with the paper's settings as defaults (IV-B).

They are those of OpenCV's detector in less time: the corners are found by compiled code,
and OpenCV describes only those that are kept.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from aick_ros import kernels
from aick_ros.errors import InputError
from aick_ros.features.detector import Choice, Features, every_keypoint
from aick_ros.settings import FeatureSettings

_RANKED = 2  # by definition of OpenCV: corners per keypoint that are ranked by their response
_BEYOND_PATCH = 8  # by definition of the kernels: pixels that they read beyond a patch


class OrbDetector:
    """Oriented FAST corners with rotated BRIEF descriptors of 256 bits."""

    def __init__(self, settings: FeatureSettings) -> None:
        self._settings = settings
        orb = self._orb = settings.orb
        self._min_side = 2 * orb.scale_factor ** (orb.levels - 1)
        # in single precision, as in OpenCV
        factor = float(np.float32(orb.scale_factor))
        self._scales = np.array([factor ** level for level in range(orb.levels)], np.float32)
        self._counts = _counts(orb.nfeatures, factor, orb.levels)
        self._half_widths = _half_widths(orb.patch_size // 2)
        self._border = orb.patch_size // 2 + _BEYOND_PATCH
        self._describer = cv2.ORB_create(  # type: ignore[attr-defined]  # missing in the stubs
            nlevels=1, edgeThreshold=0, WTA_K=2, patchSize=orb.patch_size)

    def __reduce__(self) -> tuple[type[OrbDetector], tuple[FeatureSettings]]:
        """Pickle the settings: OpenCV's detectors cannot be."""
        return OrbDetector, (self._settings,)

    def detect(self, grey: np.ndarray) -> Features:
        """
        Return the keypoints of an HxW uint8 image.

        :raises InputError: if the smallest pyramid level would be empty.
        """
        return self.detect_some(grey, every_keypoint)

    def detect_some(self, grey: np.ndarray, choose: Choice) -> Features:
        """
        Return the chosen ones of the keypoints of an HxW uint8 image.

        :raises InputError: if the smallest pyramid level would be empty.
        """
        if min(grey.shape) < self._min_side:
            raise InputError(
                f'an image of {grey.shape[1]} x {grey.shape[0]} pixels is too small for the '
                'pyramid: lower features.orb.levels or features.orb.scale_factor')
        levels = self._pyramid(grey)
        corners = [self._corners(level, image) for level, image in enumerate(levels)]
        octaves = np.repeat(np.arange(len(levels)), [len(found) for found in corners])
        places, responses = np.split(np.concatenate(corners), [2], axis=1)
        scales = self._scales[octaves]
        pixels, responses = places * scales[:, None], responses[:, 0].copy()
        chosen = choose(pixels, responses)
        descriptors = self._described(levels, octaves[chosen], places[chosen])
        return Features(pixels[chosen], descriptors, responses[chosen], scales[chosen])

    def _pyramid(self, grey: np.ndarray) -> list[np.ndarray]:
        """Return the image at each scale, with a border around it."""
        levels = [np.ascontiguousarray(grey)]
        for scale in self._scales[1:]:
            level = np.empty([int(np.rint(np.float32(side) / scale)) for side in grey.shape],
                             np.uint8)
            kernels.shrink(levels[-1], level)
            levels.append(level)
        width = self._border
        return [np.asarray(cv2.copyMakeBorder(level, width, width, width, width,
                                              cv2.BORDER_REFLECT_101)) for level in levels]

    def _corners(self, level: int, image: np.ndarray) -> np.ndarray:
        """Return the best corners of one level, Kx3 float32 (x, y, response) in its pixels."""
        wanted = self._counts[level]
        found = np.frombuffer(kernels.corners(
            image, self._border, self._orb.fast_threshold, self._orb.edge_threshold,
            _RANKED * wanted), np.float32).reshape(-1, 3)
        if not wanted or len(found) <= wanted:
            return found[:wanted]
        responses = found[:, 2]
        last = len(found) - wanted
        best: np.ndarray = found[responses >= np.partition(responses, last)[last]]
        return best

    def _described(self, levels: list[np.ndarray], octaves: np.ndarray,
                   places: np.ndarray) -> np.ndarray:
        """
        Return the descriptors of corners, Kx32.

        :param octaves: K, their levels.
        :param places: Kx2 float32, in the pixels of their levels.
        """
        descriptors = np.empty((len(places), 32), np.uint8)
        inner = slice(self._border, -self._border)
        for level, image in enumerate(levels):
            rows = np.flatnonzero(octaves == level)
            if len(rows):
                keypoints = self._oriented(image, places[rows])
                descriptors[rows] = self._describer.compute(image[inner, inner], keypoints)[1]
        return descriptors

    def _oriented(self, image: np.ndarray, places: np.ndarray) -> list[cv2.KeyPoint]:
        """Return corners of one level with the direction of the centroid of their patch."""
        directions = np.empty(len(places))
        kernels.disc_directions(image, self._border, self._half_widths, places, directions)
        size = self._orb.patch_size
        return [cv2.KeyPoint(x, y, size, direction)
                for (x, y), direction in zip(places.tolist(), directions.tolist())]


def _counts(count: int, factor: float, levels: int) -> list[int]:
    """Return the numbers of keypoints of the levels, in proportion to their sides."""
    ratio = np.float32(1.0 / factor)
    share = np.float32(count) * (1 - ratio) / (1 - np.float32(float(ratio) ** levels))
    counts = []
    for _ in range(levels - 1):
        counts.append(int(np.rint(share)))
        share *= ratio
    return [*counts, max(count - sum(counts), 0)]


def _half_widths(radius: int) -> np.ndarray:
    """Return half the widths of the rows of a disc, from the middle one on, in whole pixels."""
    rows = np.arange(radius + 1)
    widths = np.rint(np.sqrt(radius ** 2 - rows ** 2)).astype(np.int64)
    steep = rows >= radius * math.sqrt(0.5)  # mirrored, so that rows and columns are alike
    widths[steep] = (widths[:, None] >= rows[steep]).sum(axis=0) - 1
    return widths
