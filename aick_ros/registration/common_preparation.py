# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Two frames that are prepared alike: by the same settings, and free of one and the same distortion.

Both may change between two frames that are registered to each other. Keypoints of other settings
are not found again, and what is left of a distortion would be taken for a motion.
"""

from __future__ import annotations

from aick_ros.borders.records import replaced
from aick_ros.errors import InputError
from aick_ros.frames.depth_distortion import NO_DISTORTION, DepthDistortion
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.repetition import Repeat
from aick_ros.registration.last_results import LastResults
from aick_ros.registration.preparation import Preparer
from aick_ros.settings import PreparationSettings


class CommonDistortion:
    """
    Frees frames of the distortion that others are free of, whatever their settings.

    :param preparer: makes surfaces.
    :param count: of the frames that one is registered to at once: they are freed once.
    """

    def __init__(self, preparer: Preparer, count: int) -> None:
        self._preparer, self._count = preparer, count
        self._distortion = NO_DISTORTION
        self.forget()

    def forget(self) -> None:
        """Forget the frames that were freed, which take some megabytes each."""
        self._freed = LastResults(self._free, self._count)

    def __call__(self, frame: PreparedFrame, other: PreparedFrame) -> PreparedFrame:
        """Return a frame free of the distortion that another one is free of."""
        if frame.distortion == other.distortion:
            return frame
        if other.distortion != self._distortion:
            self._distortion = other.distortion
            self.forget()
        return self._freed(frame)

    def _free(self, prepared: PreparedFrame) -> PreparedFrame:
        change = DepthDistortion(self._distortion.nodes - prepared.distortion.nodes)
        keypoints = prepared.keypoints
        frame = replaced(prepared.frame, depth=change.undistorted(prepared.frame.depth))
        positions = change.moved(keypoints.positions, frame.camera)
        return replaced(
            prepared, frame=frame, distortion=self._distortion,
            keypoints=replaced(keypoints, positions=positions),
            surface=None if prepared.surface is None else self._preparer.surface(frame))


class CommonPreparation:
    """
    Prepares frames as others are.

    :param preparer: makes keypoints and surfaces, by the settings of now.
    :param count: of the frames that one is registered to at once: they are prepared once.
    """

    def __init__(self, preparer: Preparer, count: int) -> None:
        self._preparer = preparer
        self._without_distortion = CommonDistortion(preparer, count)
        self._again = LastResults(self._prepare_again, count)

    def __call__(self, frame: PreparedFrame, other: PreparedFrame) -> PreparedFrame:
        """
        Return a frame prepared as another one is.

        :raises InputError: where it is not, and the other one is not by the settings of now.
        """
        if (frame.distortion, frame.settings) == (other.distortion, other.settings):
            return frame
        if self._settings_of(other) != self._preparer.settings:
            raise InputError('the source is prepared by other settings than those of the '
                             'registrar: prepare it by these')
        return self.prepared_again(self._without_distortion(frame, other))

    def prepared_again(self, prepared: PreparedFrame) -> PreparedFrame:
        """Return a frame with keypoints and surface by the settings of now: itself if it has."""
        if self._settings_of(prepared) == self._preparer.settings:
            return prepared
        return self._again(prepared)

    def _prepare_again(self, prepared: PreparedFrame) -> PreparedFrame:
        frame = self._preparer.masked(prepared.frame)
        has_surface = prepared.repeat is not Repeat.DEPTH
        return replaced(
            prepared, frame=frame, grey=frame.grey, is_tracked=False,
            keypoints=self._preparer.keypoints(frame),
            surface=self._preparer.surface(frame) if has_surface else None,
            settings=self._preparer.settings)

    def _settings_of(self, prepared: PreparedFrame) -> PreparationSettings:
        return prepared.settings or self._preparer.settings
