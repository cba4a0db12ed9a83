# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Names of what the node counts; they are keys in ``/diagnostics``."""

from enum import Enum


class Count(Enum):
    """A quantity that is counted from the start of the node."""

    RECEIVED = 'frames received'
    ANSWERED = 'frames answered'
    LOST = 'frames lost'
    BY_DEPTH_ALONE = 'frames registered by depth alone'
    BY_COLOUR_ALONE = 'frames registered by colour alone'
    REPEATED = 'frames with an image that repeats'
    DAMAGED = 'frames damaged'
    FAILED = 'internal errors'
    STAMP_NOT_NEWER = 'frames whose stamp repeats or goes back'
    DROPPED_UNDER_LOAD = 'frames dropped under load'
    DROPPED_WHILE_WAITING = 'frames dropped while transforms were late'
    SKIPPED_WHILE_PAUSED = 'frames skipped while paused'
    DROPPED_BY_RESET = 'frames dropped by a reset'
    SKIPPED_BY_RATE_LIMIT = 'frames skipped by max_update_rate'
    SKIPPED_TO_SHED_LOAD = 'frames skipped to shed load'
    IMAGES_REJECTED = 'images rejected'
    COLOUR_UNPAIRED = 'colour images without depth'
    DEPTH_UNPAIRED = 'depth images without colour'
    COLOUR_MISSING = 'colour images that did not arrive'
    DEPTH_MISSING = 'depth images that did not arrive'
