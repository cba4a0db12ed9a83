# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Keypoints, their descriptors and their words."""

from aick_ros.features.choice import make_detector
from aick_ros.features.detector import Detector, Features

__all__ = ['Detector', 'Features', 'make_detector']
