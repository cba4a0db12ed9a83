# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The pose of a robot's base from that of the camera on it."""

from __future__ import annotations

from enum import Enum

import numpy as np

from aick_ros.geometry import se3


class Mount(Enum):
    """How a camera sits on the base, and so what it means that its extrinsic changes."""

    FIXED = 'the extrinsic has been corrected'
    MOVING = 'the camera has been moved'


class BasePose:
    """
    Follows the base by the motion of the camera.

    The camera's own odometry has the frame *visual*. Where it lies in the base's odometry is
    found anew whenever the base is put somewhere or the extrinsic of a fixed camera is corrected,
    such that the base stays where it was: from there on only motion is added.

    :param T_odom_base: where it starts, 4x4.
    :param covariance: 6x6 of that.
    """

    def __init__(self, T_odom_base: np.ndarray, covariance: np.ndarray) -> None:
        self._T_base_camera: np.ndarray | None = None
        self._T_visual_camera: np.ndarray | None = np.eye(4)
        self._visual_covariance = np.zeros((6, 6))
        self.put(T_odom_base, covariance)

    @property
    def T_odom_base(self) -> np.ndarray:
        """Where the base is, 4x4."""
        return self._T_odom_base

    def put(self, T_odom_base: np.ndarray, covariance: np.ndarray) -> None:
        """Say where the base is, whatever it was before."""
        self._T_odom_base, self._covariance = T_odom_base, covariance
        self._anchored = False

    def restart(self) -> None:
        """Take note that the way to the camera's next pose tells nothing: the base stays."""
        self._T_visual_camera = None
        self._anchored = False

    def follow(self, T_visual_camera: np.ndarray, covariance: np.ndarray,
               T_base_camera: np.ndarray, mount: Mount = Mount.FIXED
               ) -> tuple[np.ndarray, np.ndarray]:
        """
        Return where the base is for a camera, and its 6x6 covariance.

        :param covariance: 6x6 of ``T_visual_camera``, accumulated.
        :param T_base_camera: the extrinsic.
        :param mount: what it means if that is another one than before.
        """
        corrected = mount is Mount.FIXED and not np.array_equal(
            T_base_camera, self._T_base_camera)
        if self._T_base_camera is None or corrected:
            self._T_base_camera = T_base_camera
            self._anchored = False
        if self._T_visual_camera is None:
            self._T_visual_camera, self._visual_covariance = T_visual_camera, covariance
            self._T_base_camera = T_base_camera
        if not self._anchored:
            self._anchor()
        self._T_visual_camera, self._visual_covariance = T_visual_camera, covariance
        self._T_base_camera = T_base_camera
        T_camera_base = se3.inverse(T_base_camera)
        self._T_odom_base = self._T_odom_visual @ T_visual_camera @ T_camera_base
        self._covariance = self._start_covariance(self._T_odom_base) + self._way_covariance(
            T_visual_camera, covariance, T_camera_base)
        return self._T_odom_base, self._covariance

    def _anchor(self) -> None:
        """Find the visual frame such that the base did not move; from here on motion counts."""
        self._T_odom_visual = (self._T_odom_base @ self._T_base_camera
                               @ se3.inverse(self._T_visual_camera))
        self._start = self._T_odom_base, self._covariance
        self._visual_start = self._T_visual_camera, self._visual_covariance
        self._anchored = True

    def _start_covariance(self, T_odom_base: np.ndarray) -> np.ndarray:
        T_start, covariance = self._start
        return _carried(covariance, T_odom_base[:3, 3] - T_start[:3, 3])

    def _way_covariance(self, T_visual_camera: np.ndarray, covariance: np.ndarray,
                        T_camera_base: np.ndarray) -> np.ndarray:
        """Return what came to the camera's covariance since the start, as that of the base."""
        T_start, start_covariance = self._visual_start
        if start_covariance.any():
            grown = covariance - _carried(
                start_covariance, T_visual_camera[:3, 3] - T_start[:3, 3])
            scales, axes = np.linalg.eigh(grown)
            covariance = axes * np.maximum(scales, 0.0) @ axes.T
        turn = np.kron(np.eye(2), self._T_odom_visual[:3, :3])
        lever = T_visual_camera[:3, :3] @ T_camera_base[:3, 3]
        return turn @ _carried(covariance, lever) @ turn.T


def _carried(covariance: np.ndarray, lever: np.ndarray) -> np.ndarray:
    """Return the covariance of a point that lies ``lever`` [m] from the one it is given for."""
    carry = np.eye(6)
    carry[:3, 3:] = -se3.skew(lever)
    return carry @ covariance @ carry.T
