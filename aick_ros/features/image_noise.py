# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Noise of an image."""

from __future__ import annotations

import cv2
import numpy as np

from aick_ros.geometry.median import SIGMA_PER_MEDIAN, median

# The difference of two Laplacians: it sees neither edges that are straight nor shading.
_MASK = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32)
_MASK_NORM = 6.0  # derived: the root of the sum of its squares
_EVERY = 4  # chosen: every fourth pixel of every fourth row shows it


def noise_of(grey: np.ndarray) -> float:
    """
    Return the standard deviation of the noise of an HxW uint8 image [grey levels].

    By the mask of Immerkaer 1996 (Fast noise variance estimation), but by the median, which what
    little texture an image has does not enlarge.
    """
    seen = cv2.filter2D(grey, cv2.CV_32F, _MASK)[1:-1:_EVERY, 1:-1:_EVERY]
    return SIGMA_PER_MEDIAN * median(np.abs(seen).ravel()) / _MASK_NORM if seen.size else 0.0
