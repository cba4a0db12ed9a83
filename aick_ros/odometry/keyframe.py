# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The frames that others are registered to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.result import Registration
from aick_ros.settings import Settings


@dataclass(frozen=True, eq=False)
class Anchor:
    """
    A frame with a pose.

    :param covariance: 6x6 of ``T_odom_camera``.
    :param T_keyframe_camera: as registered; the identity where the frame is a keyframe itself.
    :param keyframe_covariance: 6x6 of that.
    """

    prepared: PreparedFrame
    T_odom_camera: np.ndarray
    covariance: np.ndarray
    T_keyframe_camera: np.ndarray = field(default_factory=lambda: np.eye(4))
    keyframe_covariance: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))

    def motion_to(self, T_keyframe_camera: np.ndarray,
                  covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """
        Return the motion from this frame to another one of the same keyframe.

        The noise of the keyframe is in both registrations, about half of each, and cancels.

        :param covariance: 6x6 of the other's registration.
        :returns: ``T_camera0_camera1`` and its 6x6 covariance.
        """
        motion = se3.inverse(self.T_keyframe_camera) @ T_keyframe_camera
        if not self.keyframe_covariance.any():
            return motion, covariance
        return motion, 0.5 * se3.relative_covariance(
            self.T_keyframe_camera, self.keyframe_covariance, T_keyframe_camera, covariance)


class OneFrame:
    """A reference that is one frame as it is; compare LocalMap."""

    def register(self, registrar: Registrar, prepared: PreparedFrame, target: PreparedFrame,
                 expected: np.ndarray | None, elapsed: float) -> Registration:
        """Return where a view was, seen from the frame."""
        return registrar.register(prepared, target, expected, elapsed)

    def start(self, prepared: PreparedFrame) -> PreparedFrame:
        """Return what others are registered to."""
        return prepared

    def update(self, prepared: PreparedFrame, registration: Registration) -> PreparedFrame:
        """Return the frame after another one was registered to it."""
        return prepared

    def propagate(self, prepared: PreparedFrame, new: PreparedFrame,
                  registration: Registration) -> PreparedFrame:
        """Return the frame that follows."""
        return new


class KeyframePolicy:
    """
    Decides how long a frame serves as the reference.

    A keyframe does not add its error anew with every frame, but the farther the camera moves, the
    less of it is seen, and the worse a registration gets. It is kept while enough of it is seen,
    and while a registration to it is surer than one to the frame before and on from there.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings.odometry
        refined = settings.refinement.mode != 'none'
        self._most_tracked = settings.refinement.max_tracks if refined else np.inf
        self.begin()

    def begin(self) -> None:
        """Forget the keyframe: the next registration is to another one."""
        self._first = self._last = 0.0

    def keeps(self, prepared: PreparedFrame, registration: Registration) -> bool:
        """Return whether the keyframe that a view was registered to still serves the next one."""
        if self._settings.reference == 'previous':
            return False
        variance = _variance(prepared, registration.covariance)
        if self._first == 0.0:
            self._first = self._last = variance
        surer = variance <= self._last + self._first
        self._last = variance
        sought = min(len(prepared.keypoints), self._most_tracked)
        enough = registration.support >= self._settings.min_overlap * sought
        if not (surer and enough):
            self.begin()
        return surer and enough


def _variance(prepared: PreparedFrame, covariance: np.ndarray) -> float:
    """Return the variance of where a registration puts what the view sees [m^2]."""
    distance = float(np.median(prepared.keypoints.positions[:, 2]))
    return float(np.trace(covariance[:3, :3]) + distance ** 2 * np.trace(covariance[3:, 3:]))
