# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A base that moves in a plane, as a robot on wheels does."""

from __future__ import annotations

import math

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.geometry.pose_fusion import Fusion
from aick_ros.odometry.inertial.disagreement import Disagreement
from aick_ros.odometry.motion_term import MotionTerm
from aick_ros.settings import OdometrySettings

_MEMORY = 30.0  # frames; chosen: a second at 30 Hz
_WRONG, _RIGHT = 0.2, 0.05
"""Shares of them outside of the plane from which on it is none, or one again.

Chosen: in a rendered corridor none is, and 0.2 to 0.7 of those of a hand on two excerpts of real
recordings, whose poses are drawn into the plane from frame to frame."""


class Plane:
    """
    The plane in which a base begins, as a term of the least-squares problem of each pose.

    It measures three directions: the height above the plane, and the tilt against it. They are
    added to a pose with its covariance since the start, so that what the images leave uncertain
    is drawn into the plane, and what correlates with it too.

    :param settings: whether there is a plane, and how even it is.
    """

    def __init__(self, settings: OdometrySettings) -> None:
        self._is_used = False
        self._T_base_camera: np.ndarray | None = None
        self._disagreement = Disagreement(_MEMORY, _WRONG, _RIGHT)
        self._off = np.zeros(3)  # of the last frame outside: height [m], tilt about both axes
        self.configure(settings)

    def configure(self, settings: OdometrySettings) -> None:
        """Continue with other settings, in the same plane; where there was none, in a new one."""
        if not self._is_used:
            self.reset()
        self._is_used = settings.planar
        self._covariance = np.square(np.diag(
            [settings.planar_sigma, settings.planar_tilt_sigma, settings.planar_tilt_sigma]))

    def reset(self) -> None:
        """Forget the plane."""
        self._T_reckoned_base: np.ndarray | None = None
        self._disagreement = Disagreement(_MEMORY, _WRONG, _RIGHT)

    @property
    def complaint(self) -> str:
        """The contradiction of the camera to the plane, in words; '' where it moves there."""
        if not self._is_used or not self._disagreement.is_wrong:
            return ''
        height, tilt = abs(self._off[0]), math.degrees(math.hypot(*self._off[1:]))
        return (f'the camera moves by {height:.2f} m and {tilt:.1f} deg out of the plane of '
                'odometry.planar in a few frames: check that z of frame_id points up from the '
                'floor, and its transform to the camera')

    @property
    def has_base(self) -> bool:
        """The plane is that of a base, so that what is level does not matter."""
        return self._is_used and self._T_base_camera is not None

    def mount(self, T_base_camera: np.ndarray | None) -> None:
        """
        Set the extrinsic of the frames that follow, 4x4; None: the base is the camera.

        :raises InputError: where it is not rigid; the one before stays.
        """
        self._T_base_camera = (None if T_base_camera is None
                               else se3.checked(T_base_camera, 'T_base_camera'))

    def begin(self, T_reckoned_camera: np.ndarray) -> None:
        """Begin with a first pose, 4x4, unless there is a plane."""
        if self._T_reckoned_base is None:
            self._T_camera_level = np.eye(4)
            self._T_camera_level[:3, :3] = T_reckoned_camera[:3, :3].T
            self._T_reckoned_base = T_reckoned_camera @ self._T_camera_base

    def fused(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return a pose ``T_reckoned_camera`` with the term."""
        fusion = self._fusion(pose)
        return pose if fusion is None else fusion.pose

    def measured(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return what :meth:`fused` does, of a pose that was measured; note if it is outside."""
        fusion = self._fusion(pose)
        if fusion is None:
            return pose
        self._disagreement.note(fusion.is_of_noise)
        if not fusion.is_of_noise:
            self._off = fusion.error
        return fusion.pose

    def _fusion(self, pose: PoseWithCovariance) -> Fusion | None:
        """Return a pose fused with the term; None: there is no plane."""
        if not self._is_used or self._T_reckoned_base is None:
            return None
        return self._term(pose.matrix, self._T_reckoned_base).added_to(pose)

    @property
    def _T_camera_base(self) -> np.ndarray:
        return (self._T_camera_level if self._T_base_camera is None
                else se3.inverse(self._T_base_camera))

    def _term(self, T_reckoned_camera: np.ndarray, T_reckoned_start: np.ndarray) -> MotionTerm:
        """Return height and tilt of a pose, measured to be none."""
        x, y, normal = T_reckoned_start[:3, :3].T
        T_reckoned_base = T_reckoned_camera @ self._T_camera_base
        turn = se3.rotation_between(T_reckoned_base[:3, 2], normal)
        # where the base is not at the camera, it is lifted by a turn
        lift = np.cross(T_reckoned_base[:3, 3] - T_reckoned_camera[:3, 3], normal)
        height = normal @ (T_reckoned_base[:3, 3] - T_reckoned_start[:3, 3])
        in_plane = se3.perturbed(
            T_reckoned_camera, np.append(-(height + lift @ turn) * normal, turn))
        rows = np.zeros((3, 6))
        rows[0, :3], rows[:, 3:] = normal, [lift, x, y]
        return MotionTerm(in_plane, rows, self._covariance)
