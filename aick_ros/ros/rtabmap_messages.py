# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The messages of RTAB-Map, an optional dependency; None each where it is not installed."""

__all__ = ['INSTALL_RTABMAP_MSGS', 'OdomInfo', 'Point2f', 'RGBDImage', 'RGBDImages']

try:
    from rtabmap_msgs.msg import OdomInfo, Point2f, RGBDImage, RGBDImages
except ImportError:
    OdomInfo = Point2f = RGBDImage = RGBDImages = None

INSTALL_RTABMAP_MSGS = 'install it (apt install ros-jazzy-rtabmap-msgs)'
"""Remedy where they are missing."""
