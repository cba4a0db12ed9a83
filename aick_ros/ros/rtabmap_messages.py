# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The interfaces of RTAB-Map, an optional dependency; None each where it is not installed."""

__all__ = ['INSTALL_RTABMAP_MSGS', 'OdomInfo', 'Point2f', 'RGBDImage', 'RGBDImages', 'ResetPose']

try:
    from rtabmap_msgs.msg import OdomInfo, Point2f, RGBDImage, RGBDImages
    from rtabmap_msgs.srv import ResetPose
except ImportError:
    OdomInfo = Point2f = RGBDImage = RGBDImages = ResetPose = None

INSTALL_RTABMAP_MSGS = 'install it (apt install ros-jazzy-rtabmap-msgs)'
"""Remedy where they are missing."""
