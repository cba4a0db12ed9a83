# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The path of the camera: its pose by dead reckoning, and as it is published."""

from __future__ import annotations

import numpy as np

from aick_ros.frames.prepared import PreparedFrame
from aick_ros.geometry import se3
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry.effort import Effort
from aick_ros.odometry.inertial.first_force import RotationBetween
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.level import Turn
from aick_ros.odometry.keyframe_memory import KeyframeMemory
from aick_ros.odometry.plane import Plane
from aick_ros.odometry.position_filter import PositionFilter
from aick_ros.odometry.reference import Reference
from aick_ros.registration.depth_pair import KnownView
from aick_ros.registration.registrar import Registrar
from aick_ros.registration.systematic_error import errors_of_scale
from aick_ros.settings import Settings


class Path:
    """
    Adds up poses in a frame of their own, by dead reckoning, in the plane if there is one.

    What is published is corrected by keyframes that are found again and levelled by gravity, and
    positions that are uncertain are held by the velocity. It has the scale error of depth, by the
    distance from where the path begins.

    :param turn: rotation by a gyroscope.
    """

    def __init__(self, settings: Settings, turn: RotationBetween) -> None:
        self.gravity = Gravity(settings.imu, turn)
        self.plane = Plane(settings.odometry)
        self._filter = PositionFilter(settings.odometry)
        self._memory: KeyframeMemory | None = None  # there is none before the first frame

    def configure(self, settings: Settings, registrar: Registrar) -> None:
        """Continue with other settings."""
        self._settings, self._registrar = settings, registrar
        self.gravity.configure(settings.imu)
        self.plane.configure(settings.odometry)
        self._filter.configure(settings.odometry)
        if self._memory is not None:
            self._memory.configure(settings, registrar)
            self.plane.begin(self._pose.matrix)

    def reset(self, T_odom_camera: np.ndarray | None = None) -> None:
        """
        Forget all poses; the first frame gets the one given or, without one, a level one.

        :raises InputError: where the pose is not rigid; nothing is changed then.
        """
        pose = np.eye(4) if T_odom_camera is None else se3.checked(T_odom_camera, 'T_odom_camera')
        self._is_placed = T_odom_camera is not None
        self._has_restarted = False  # the recording, so that the camera may be turned otherwise
        self._ended: Turn | None = None  # of a start that was held until the last restart
        self.gravity.reset()
        self.plane.reset()
        self._begin(PoseWithCovariance(pose))

    def restart(self) -> None:
        """
        Begin another recording where the last frame was published; the camera may be turned.

        A start that is held stays as level as it is, and as uncertain as it is doubted; one that
        is contradicted is given up.
        """
        self._ended = self.begin_level(0.0)
        self._begin(self.published)
        self._has_restarted = True

    def _begin(self, pose: PoseWithCovariance) -> None:
        self._pose = pose
        self._beginning = pose.translation.copy()  # of the published path, 3 [m]
        self._memory = None
        self._filter.reset()
        self.gravity.restart()

    def begin_level(self, sigma: float) -> Turn | None:
        """
        Let the path have begun level by what is known now, as :meth:`Gravity.begin_anew`.

        :returns: after a restart that has ended the hold the turn of the poses before that.
        """
        ended, self._ended = self._ended, None
        if ended is not None:
            return ended
        T_odom_reckoned = np.eye(4) if self._memory is None else self._memory.T_odom_reckoned
        return self.gravity.begin_anew(T_odom_reckoned, self._corrected, sigma)

    @property
    def published(self) -> PoseWithCovariance:
        """The last pose, corrected by keyframes found again, level, held by the motion before."""
        pose = self.gravity.levelled(self._corrected) @ self._filter.T_measured_filtered
        scale = errors_of_scale(pose.translation - self._beginning,
                                self._settings.sensor.depth_scale_sigma)
        return pose.with_covariance(pose.covariance + scale)

    @property
    def _corrected(self) -> PoseWithCovariance:
        """The last pose, corrected by keyframes found again."""
        return self._pose if self._memory is None else self._memory.published(self._pose)

    def local_map(self) -> np.ndarray:
        """Return the keypoints of the keyframes in memory, in the last camera's frame, Nx3 [m]."""
        if self._memory is None:
            return np.empty((0, 3))
        return self._memory.keypoints_from(self._pose)

    def views_beside(self, T_newest_target: np.ndarray, most: int) -> list[KnownView]:
        """Return keyframes in memory, as :meth:`KeyframeMemory.views_beside` does."""
        assert self._memory is not None  # by the first frame
        return self._memory.views_beside(T_newest_target, most)

    def mount(self, T_base_camera: np.ndarray | None) -> None:
        """
        Set the extrinsic of the frames that follow, 4x4; None: the base is the camera.

        :raises InputError: where it is not rigid; the one before stays.
        """
        self.plane.mount(T_base_camera)

    def start(self, prepared: PreparedFrame) -> Reference:
        """Return a first frame with its pose; it is the first keyframe in memory."""
        if not self._is_placed and not self.plane.has_base:
            self._pose = self.gravity.begin(prepared.stamp) or self._pose
        elif self._has_restarted:
            self._pose = self.gravity.begin_again(prepared.stamp, self._pose) or self._pose
        self._is_placed, self._has_restarted = True, False
        self.plane.begin(self._pose.matrix)
        first = Reference(prepared, self._pose)
        self._memory = KeyframeMemory(self._settings, self._registrar, first, self.plane.fused)
        return first

    def fused(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Return a pose by dead reckoning in the plane, if there is one."""
        return self.plane.fused(pose)

    def move_to(self, pose: PoseWithCovariance) -> PoseWithCovariance:
        """Continue at a pose by dead reckoning, ``T_reckoned_camera``; return it in the plane."""
        self._pose = self.plane.fused(pose)
        return self._pose

    def velocity_at(self, stamp: int, measured: PoseWithCovariance) -> np.ndarray | None:
        """
        Return the filtered velocity at a pose, along the axes of its camera, 3 [m/s].

        :param measured: ``T_reckoned_camera``, with the covariance of this measurement alone.
        :returns: None: it is not known.
        """
        self._filter.update(stamp, measured)
        return self._filter.velocity

    def track(self, stamp: int, reference: PoseWithCovariance, seen: PoseWithCovariance,
              keyframe: Reference, detour: np.ndarray, interval: float, effort: Effort) -> None:
        """
        Advance to a pose that was measured; parameters are as for :meth:`KeyframeMemory.track`.

        :param stamp: of the frame [ns].
        :param reference: ``T_reckoned_reference``, of what the frame was registered to.
        :param seen: ``T_reference_camera``.
        """
        assert self._memory is not None  # by the first frame
        self._pose = self.plane.measured(reference @ seen)
        self._memory.track(keyframe, self._pose.matrix, detour, interval, effort)
        self.gravity.update(stamp, reference, reference.matrix @ seen,
                            self._memory.T_odom_reckoned, self._corrected)
