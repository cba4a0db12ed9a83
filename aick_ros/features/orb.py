# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
ORB keypoints (Rublee et al. 2011), with the paper's settings as defaults (IV-B).

They are those of OpenCV's detector in less time: the corners are found by compiled code, and
only those that are kept are described. An image with less than half of the keypoints wanted has
weaker ones too, by a lower threshold than OpenCV's.
"""

from __future__ import annotations

import math

import numpy as np

from aick_ros import kernels
from aick_ros.errors import InputError
from aick_ros.features import orb_pattern
from aick_ros.features.detector import Choice, Features, every_keypoint
from aick_ros.features.image_noise import noise_of
from aick_ros.features.mirrored_border import with_border
from aick_ros.settings import FeatureSettings

_RANKED = 2  # by definition of OpenCV: corners per keypoint that are ranked by their response
_FEW = 0.5  # chosen: share of the keypoints wanted below which weaker ones are found
_CERTAIN = 3.0  # chosen: standard deviations of the image noise that a corner exceeds
_BEYOND_PATCH = 8  # by definition of the kernels: pixels that they read beyond a patch


class OrbDetector:
    """Oriented FAST corners with rotated BRIEF descriptors of 256 bits."""

    def __init__(self, settings: FeatureSettings) -> None:
        orb = self._orb = settings.orb
        self._min_side = 2 * orb.scale_factor ** (orb.levels - 1)
        # in single precision, as in OpenCV
        factor = float(np.float32(orb.scale_factor))
        self._scales = np.array([factor ** level for level in range(orb.levels)], np.float32)
        self._counts = _counts(orb.nfeatures, factor, orb.levels)
        self._half_widths = _half_widths(orb.patch_size // 2)
        self._border = max(orb.patch_size // 2 + _BEYOND_PATCH,
                           orb_pattern.least_border(orb.patch_size))

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
        corners = self._corners_of(levels, grey)
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
        return [with_border(level, self._border) for level in levels]

    def _corners_of(self, levels: list[np.ndarray], grey: np.ndarray) -> list[np.ndarray]:
        """Return the best corners of each level; weaker ones too, where there are few."""
        threshold = self._orb.fast_threshold
        corners = [self._corners(level, image, threshold) for level, image in enumerate(levels)]
        if sum(map(len, corners)) >= _FEW * self._orb.nfeatures:
            return corners
        lower = max(self._orb.min_fast_threshold, math.ceil(_CERTAIN * noise_of(grey)))
        if lower >= threshold:
            return corners
        return [self._corners(level, image, lower) for level, image in enumerate(levels)]

    def _corners(self, level: int, image: np.ndarray, threshold: int) -> np.ndarray:
        """Return the best corners of one level, Kx3 float32 (x, y, response) in its pixels."""
        wanted = self._counts[level]
        found = np.frombuffer(kernels.corners(
            image, self._border, threshold, self._orb.edge_threshold,
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
        Return the descriptors of corners, Kx32, and leave the levels blurred.

        :param octaves: K, their levels.
        :param places: Kx2 float32, in the pixels of their levels.
        """
        order = np.argsort(octaves, kind='stable')
        ends = np.cumsum(np.bincount(octaves, minlength=len(levels))).tolist()
        places, directions = places[order], np.empty(len(places))
        descriptors = np.empty((len(places), 32), np.uint8)
        for image, rows in zip(levels, map(slice, [0, *ends], ends)):
            if rows.start < rows.stop:
                kernels.disc_directions(image, self._border, self._half_widths, places[rows],
                                        directions[rows])
                descriptors[order[rows]] = orb_pattern.describe(
                    image, self._border, self._orb.patch_size, places[rows], directions[rows])
        return descriptors


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
