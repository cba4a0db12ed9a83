# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SIFT keypoints (Lowe 2004) by OpenCV."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.features.detector import Features
from aick_ros.settings import FeatureSettings


class SiftDetector:
    """Extrema of differences of Gaussians with 128 gradient sums, scaled to unit length."""

    def __init__(self, settings: FeatureSettings) -> None:
        self._settings = settings
        sift = settings.sift
        # positional arguments, because their names differ between versions of OpenCV
        self._sift = cv2.SIFT_create(  # type: ignore[attr-defined]  # missing in the stubs
            sift.nfeatures, sift.octave_layers, sift.contrast_threshold, sift.edge_threshold,
            sift.sigma)
        # the first octave is of the doubled image, and the size is two standard deviations
        self._finest = sift.sigma * 2.0 ** (1.0 / sift.octave_layers)

    def __reduce__(self) -> tuple[type[SiftDetector], tuple[FeatureSettings]]:
        """Pickle the settings: OpenCV's detectors cannot be."""
        return SiftDetector, (self._settings,)

    def detect(self, grey: np.ndarray) -> Features:
        """Return the keypoints of an HxW uint8 image."""
        keypoints, descriptors = self._sift.detectAndCompute(grey, None)
        if not keypoints:
            return Features(np.empty((0, 2), np.float32), np.empty((0, 128), np.float32),
                            np.empty(0, np.float32), np.empty(0, np.float32))
        length = np.linalg.norm(descriptors, axis=1, keepdims=True)
        pixels = cv2.KeyPoint_convert(keypoints)  # type: ignore[attr-defined]  # as above
        return Features(
            pixels,
            descriptors / np.maximum(length, np.finfo(np.float32).tiny),
            np.array([keypoint.response for keypoint in keypoints], np.float32),
            np.array([keypoint.size for keypoint in keypoints], np.float32)
            / np.float32(self._finest))
