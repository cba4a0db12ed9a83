# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Effort of registering a frame: work that can wait is postponed where it was large."""

from enum import IntEnum


class Effort(IntEnum):
    """Effort of registering one frame, least first."""

    LEAST = 0
    """It was registered in the shortest way that the settings allow."""
    MORE = 1
    """Another way was taken, as by keypoints of its own, or it became a keyframe."""
    MUCH = 2
    """Several refinements were needed, as where a motion was checked."""
