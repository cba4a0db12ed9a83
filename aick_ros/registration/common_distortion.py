# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Two frames free of one and the same distortion.

What is known of a distortion changes, also between two frames that are registered to each other.
Then what is left of it differs in the two, and would be taken for a motion.
"""

from __future__ import annotations

from aick_ros.borders.records import replaced
from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.preparation import Preparer


class CommonDistortion:
    """
    Brings frames to the distortion that others are free of.

    :param preparer: makes their surfaces.
    :param count: of the frames that one is registered to at once: they are brought once.
    """

    def __init__(self, preparer: Preparer, count: int) -> None:
        self._preparer, self._count = preparer, count
        self._distortion = NO_DISTORTION
        self.forget()

    def forget(self) -> None:
        """Forget the frames that were brought, which take some megabytes each."""
        self._brought = LastResults(self._bring, self._count)

    def __call__(self, frame: PreparedFrame, other: PreparedFrame) -> PreparedFrame:
        """Return a frame free of the distortion that another one is free of."""
        if frame.distortion == other.distortion:
            return frame
        if other.distortion != self._distortion:
            self._distortion = other.distortion
            self.forget()
        return self._brought(frame)

    def _bring(self, prepared: PreparedFrame) -> PreparedFrame:
        change = DepthDistortion(self._distortion.nodes - prepared.distortion.nodes)
        before, keypoints = prepared.frame, prepared.keypoints
        frame = replaced(before, depth=change.undistorted(before.depth))
        positions = change.moved(keypoints.positions, frame.camera)
        return replaced(
            prepared, frame=frame, distortion=self._distortion,
            keypoints=replaced(keypoints, positions=positions),
            surface=None if prepared.surface is None else self._preparer.surface(frame))
