# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ORB keypoints (Rublee et al. 2011) by OpenCV, with the paper's settings as defaults (IV-B)."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.errors import InputError
from aick_ros.features.detector import Features
from aick_ros.settings import FeatureSettings


class OrbDetector:
    """Oriented FAST corners with rotated BRIEF descriptors of 256 bits."""

    def __init__(self, settings: FeatureSettings) -> None:
        self._settings = settings
        orb = settings.orb
        self._scale_factor = orb.scale_factor
        self._min_side = 2 * orb.scale_factor ** (orb.levels - 1)
        self._orb = cv2.ORB_create(  # type: ignore[attr-defined]  # missing in the stubs
            nfeatures=orb.nfeatures, scaleFactor=orb.scale_factor, nlevels=orb.levels,
            edgeThreshold=orb.edge_threshold, firstLevel=0, WTA_K=2,
            scoreType=cv2.ORB_HARRIS_SCORE, patchSize=orb.patch_size,
            fastThreshold=orb.fast_threshold)

    def __reduce__(self) -> tuple[type[OrbDetector], tuple[FeatureSettings]]:
        """Pickle the settings: OpenCV's detectors cannot be."""
        return OrbDetector, (self._settings,)

    def detect(self, grey: np.ndarray) -> Features:
        """
        Return the keypoints of an HxW uint8 image.

        :raises InputError: if the smallest pyramid level would be empty.
        """
        if min(grey.shape) < self._min_side:
            raise InputError(
                f'an image of {grey.shape[1]} x {grey.shape[0]} pixels is too small for the '
                'pyramid: lower features.orb.levels or features.orb.scale_factor')
        keypoints, descriptors = self._orb.detectAndCompute(grey, None)
        if not keypoints:
            return Features(np.empty((0, 2), np.float32), np.empty((0, 32), np.uint8),
                            np.empty(0, np.float32), np.empty(0, np.float32))
        octaves = np.array([keypoint.octave for keypoint in keypoints], np.float32)
        pixels = cv2.KeyPoint_convert(keypoints)  # type: ignore[attr-defined]  # as above
        return Features(
            pixels, descriptors,
            np.array([keypoint.response for keypoint in keypoints], np.float32),
            np.float32(self._scale_factor) ** octaves)
