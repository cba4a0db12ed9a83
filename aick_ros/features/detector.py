# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Interface of the keypoint detectors, one file per detector.

A detector is a class with ``detect(grey) -> Features``; its file is imported when it is chosen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from aick_ros.settings import FeatureSettings


@dataclass(frozen=True, eq=False)
class Features:
    """
    Keypoints of an image.

    :param pixels: Nx2 float32 (u, v) [px].
    :param descriptors: NxD uint8 (binary, 8 bits per column) or float32.
    :param responses: N float32, larger is stronger.
    :param scales: N float32, scale relative to the finest; 1 at the finest.
    """

    pixels: np.ndarray
    descriptors: np.ndarray
    responses: np.ndarray
    scales: np.ndarray


class Detector(Protocol):
    """Keypoint detector with descriptor."""

    def detect(self, grey: np.ndarray) -> Features:
        """Return the keypoints of an HxW uint8 image; there may be none."""


def make_detector(settings: FeatureSettings) -> Detector:
    """Return the detector named by the settings."""
    if settings.detector == 'surf':
        from aick_ros.features.surf import SurfDetector
        return SurfDetector(settings)
    if settings.detector == 'sift':
        from aick_ros.features.sift import SiftDetector
        return SiftDetector(settings)
    from aick_ros.features.orb import OrbDetector
    return OrbDetector(settings)
