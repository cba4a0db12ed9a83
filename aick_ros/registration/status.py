# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Outcome of a registration or of a frame."""

from enum import Enum


class Status(Enum):
    """Outcome of a registration or of a frame; the value is its description for people."""

    NO_FRAME = 'no frame yet'
    OK = 'registered'
    FIRST_FRAME = 'first frame, nothing to register it to'
    TOO_FEW_KEYPOINTS = 'too few keypoints with depth'
    TOO_FEW_MATCHES = 'too few matches'
    DEGENERATE_GEOMETRY = 'matches lie on a line or in a point'
    MOTION_GATE = 'motion faster than the gate allows'
    REPEATED = 'images are those of the frame before'
    BAD_STAMP = 'stamp repeats or goes back'
    BAD_FRAME = 'frame cannot be used'

    @property
    def ok(self) -> bool:
        """A status whose pose was measured."""
        return self in (Status.OK, Status.FIRST_FRAME)

    @property
    def is_lost(self) -> bool:
        """A status of a lost camera; one whose images repeat is neither measured nor lost."""
        return not self.ok and self is not Status.REPEATED
