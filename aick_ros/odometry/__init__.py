# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A stream of frames to a trajectory."""

from aick_ros.odometry.odometry import Odometry
from aick_ros.odometry.update import OdometryUpdate

__all__ = ['Odometry', 'OdometryUpdate']
