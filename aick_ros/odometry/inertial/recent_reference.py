# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The frame that a gyroscope is compared from where the keyframe stays, as at rest."""

from __future__ import annotations

from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS

_OLDEST = 20 * NANOSECONDS  # chosen: less than the memory of the integral, by a slow frame


class RecentReference:
    """
    The keyframe or, once that is 20 s old, a later frame that was registered to it.

    A gyroscope is integrated over half a minute at most, and its bias walks meanwhile.
    """

    def __init__(self) -> None:
        self._keyframe: int | None = None  # its stamp; there is none yet
        self._stamp = 0
        self._pose = PoseWithCovariance.identity()  # T_keyframe_reference

    def motion(self, keyframe: int, now: int, seen: PoseWithCovariance
               ) -> tuple[int, PoseWithCovariance]:
        """
        Return the stamp of the reference [ns], and the motion of the camera since then.

        :param keyframe: its stamp [ns].
        :param now: stamp of the frame [ns].
        :param seen: ``T_keyframe_camera``.
        """
        if keyframe != self._keyframe:
            self._keyframe = self._stamp = keyframe
            self._pose = PoseWithCovariance.identity()
        stamp, motion = self._stamp, seen.relative_to(self._pose)
        if now - stamp > _OLDEST:
            self._stamp, self._pose = now, seen
        return stamp, motion
