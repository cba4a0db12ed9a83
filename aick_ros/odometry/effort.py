# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""How much it took to register a frame, by which work that can wait is put off."""

from enum import IntEnum


class Effort(IntEnum):
    """Effort for one frame, in the order of the time it takes."""

    LEAST = 0
    """It was registered in the shortest way that the settings allow."""
    MORE = 1
    """Another way was taken, as by keypoints of its own, or it became a keyframe."""
    MUCH = 2
    """Several refinements were needed, as where a motion was checked."""
