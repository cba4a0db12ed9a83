# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The message of TF, which the pip wheels of ROS do not have."""

__all__ = ['TFMessage', 'TF_REMEDY']

try:
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None

TF_REMEDY = ('publish the static transform between them' if TFMessage is not None else
             'tf2_msgs is not installed, so TF cannot be received')
"""Remedy where TF does not connect two frames."""
