# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""A base that moves in a plane, as a robot on wheels does."""

from __future__ import annotations

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.motion_term import MotionTerm
from aick_ros.settings import OdometrySettings


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
        if not self._is_used or self._T_reckoned_base is None:
            return pose
        return self._term(pose.matrix, self._T_reckoned_base).added_to(pose).pose

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
