# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Upright SURF keypoints (Bay et al. 2008), with the paper's settings as defaults (IV-B)."""

from __future__ import annotations

import numpy as np

from aick_ros.features.detector import Features
from aick_ros.features.haar import describe
from aick_ros.features.hessian import SCALE_OF_SIZE, filter_sizes, find_blobs
from aick_ros.settings import FeatureSettings


class SurfDetector:
    """Blobs of the box-filter Hessian with 64 sums of Haar responses, scaled to unit length."""

    def __init__(self, settings: FeatureSettings) -> None:
        self._surf = settings.surf
        self._finest = filter_sizes(0, self._surf.intervals)[1]

    def detect(self, grey: np.ndarray) -> Features:
        """Return the keypoints of an HxW uint8 image; none if it is smaller than a filter."""
        surf = self._surf
        blobs = find_blobs(grey, surf.octaves, surf.intervals, surf.init_sample, surf.threshold)
        return Features(blobs.pixels, describe(grey, blobs.pixels, SCALE_OF_SIZE * blobs.sizes),
                        blobs.responses, blobs.sizes / np.float32(self._finest))
