# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The ROS 2 side: the only files that import rclpy."""

from aick_ros.borders.threads import one_thread_per_call

one_thread_per_call()
