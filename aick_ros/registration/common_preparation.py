# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Two frames that are prepared alike: by the same settings, and free of one and the same distortion.

Both may change between two frames that are registered to each other. Keypoints of other settings
are not found again, and what is left of a distortion would be taken for a motion.
"""

from __future__ import annotations

from typing import Optional

from aick_ros.borders.records import replaced
from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.preparation import Preparer
from aick_ros.settings import PreparationSettings

_Goal = tuple[DepthDistortion, Optional[PreparationSettings]]


class CommonPreparation:
    """
    Prepares frames as others are.

    :param preparer: makes keypoints and surfaces, by the settings of now.
    :param count: of the frames that one is registered to at once: they are brought once.
    """

    def __init__(self, preparer: Preparer, count: int) -> None:
        self._preparer, self._count = preparer, count
        self._goal: _Goal = NO_DISTORTION, preparer.settings
        self.forget()

    def forget(self) -> None:
        """Forget the frames that were brought, which take some megabytes each."""
        self._brought = LastResults(self._bring, self._count)

    def __call__(self, frame: PreparedFrame, other: PreparedFrame) -> PreparedFrame:
        """Return a frame prepared as another one is, by whose settings the preparer works."""
        goal = other.distortion, other.settings
        if (frame.distortion, frame.settings) == goal:
            return frame
        if goal != self._goal:
            self._goal = goal
            self.forget()
        return self._brought(frame)

    def _bring(self, prepared: PreparedFrame) -> PreparedFrame:
        distortion, settings = self._goal
        change = DepthDistortion(distortion.nodes - prepared.distortion.nodes)
        before, keypoints = prepared.frame, prepared.keypoints
        frame = replaced(before, depth=change.undistorted(before.depth))
        if prepared.settings != settings:
            return self.prepared_again(replaced(prepared, frame=frame, distortion=distortion))
        positions = change.moved(keypoints.positions, frame.camera)
        return replaced(
            prepared, frame=frame, distortion=distortion,
            keypoints=replaced(keypoints, positions=positions),
            surface=None if prepared.surface is None else self._preparer.surface(frame))

    def prepared_again(self, prepared: PreparedFrame) -> PreparedFrame:
        """Return a frame with keypoints and surface by the settings of now: itself if it has."""
        if prepared.settings == self._preparer.settings:
            return prepared
        frame, has_surface = prepared.frame, prepared.repeat is not Repeat.DEPTH
        return replaced(
            prepared, keypoints=self._preparer.keypoints(frame), is_tracked=False,
            surface=self._preparer.surface(frame) if has_surface else None,
            settings=self._preparer.settings)
