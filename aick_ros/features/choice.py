# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The detector that the settings name; its file is imported when it is chosen."""

from __future__ import annotations

from aick_ros.features.detector import Detector
from aick_ros.settings import FeatureSettings


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
