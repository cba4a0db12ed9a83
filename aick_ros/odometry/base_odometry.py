# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Odometry of a robot's base from that of the camera on it."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.motion_model import MotionModel
from aick_ros.odometry.update import OdometryUpdate
from aick_ros.registration.status import Status
from aick_ros.settings import OdometrySettings


class Mount(Enum):
    """Mount of a camera on the base, which decides the meaning of a change of its extrinsic."""

    FIXED = 'the extrinsic has been corrected'
    MOVING = 'the camera has been moved'


class BaseState(Enum):
    """Source of the pose of the base."""

    TRACKED = 'measured'
    RECOVERED = 'measured again, from a pose that was not'
    PREDICTED = 'predicted by another sensor'
    CONTINUED = 'not measured, as the images repeat: continued'
    LOST = 'not known: the pose is the last one'


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """
    Mean motion of the base since an earlier frame, about its axes as they are now.

    :param twist: body velocity (vx, vy, vz, wx, wy, wz) [m/s, rad/s], 6.
    :param covariance: 6x6 of the increment [m^2, m rad, rad^2].
    :param interval: time of the increment [s].
    :param change: 6x6, by which the velocity now may differ from the mean [m^2/s^2, rad^2/s^2].
    """

    twist: np.ndarray
    covariance: np.ndarray
    interval: float
    change: np.ndarray = field(default_factory=lambda: np.zeros((6, 6)))

    @classmethod
    def of(cls, increment: Increment, change: np.ndarray) -> BaseMotion:
        """Return the motion of an increment ``T_base0_base1``."""
        axes_now = np.eye(4)
        axes_now[:3, :3] = increment.pose.rotation.T
        return cls(increment.twist, (axes_now @ increment.pose).covariance, increment.interval,
                   change)

    @property
    def T_before_now(self) -> np.ndarray:
        """Pose of the base now, in its frame at the start of the motion, 4x4."""
        return se3.exp(self.interval * self.twist)

    @property
    def twist_covariance(self) -> np.ndarray:
        """Covariance of the twist as the velocity now, 6x6 [m^2/s^2, m rad/s^2, rad^2/s^2]."""
        twist_covariance: np.ndarray = self.covariance / self.interval ** 2 + self.change
        return twist_covariance


@dataclass(frozen=True, eq=False)
class BaseUpdate:
    """
    Pose and motion of the base at one frame.

    :param stamp: stamp of the frame [ns].
    :param pose: ``T_odom_base``.
    :param motion: None where it was neither measured nor continued.
    """

    stamp: int
    state: BaseState
    pose: PoseWithCovariance
    motion: BaseMotion | None = None


@dataclass(frozen=True, eq=False)
class _Start:
    """A pose ``T_odom_base`` of the base, and the camera there; motion is added to it."""

    base: PoseWithCovariance
    camera: PoseWithCovariance
    T_base_camera: np.ndarray


class BaseOdometry:
    """
    Follows the base by the motion of the camera.

    The motion of the camera is added to a start: where the base was when it was last placed, or
    when the extrinsic of a fixed camera was last corrected. A correction does not move the base.
    Arrays that are given or returned may be changed by their owner.

    :param pose: ``T_odom_base`` at the camera's pose of identity; None: the identity.
    :param settings: how the velocity changes, of the base as of the camera.
    """

    def __init__(self, pose: PoseWithCovariance | None = None,
                 settings: OdometrySettings = OdometrySettings()) -> None:
        self.configure(settings)
        self.reset(pose)

    def configure(self, settings: OdometrySettings) -> None:
        """Continue with other settings."""
        self._motion_model = MotionModel(settings)

    @property
    def pose(self) -> PoseWithCovariance:
        """``T_odom_base``, the last one measured, predicted or set."""
        return self._pose.copy()

    def reset(self, pose: PoseWithCovariance | None = None) -> None:
        """
        Begin at a pose, with a camera whose odometry begins at the identity, or level.

        In the latter case roll and pitch of the base are those by gravity.

        :param pose: ``T_odom_base``; None: the identity.
        """
        self._pose = PoseWithCovariance.identity() if pose is None else pose.copy()
        self._is_lost, self._is_new = False, True
        self._is_tracked, self._is_moved = True, False  # in the last frame; by hand, since then
        self._start: _Start | None = None
        self._camera: PoseWithCovariance | None = PoseWithCovariance.identity()
        self._mounted: np.ndarray | None = None  # T_base_camera at that pose of the camera
        self._measured: tuple[int, np.ndarray] | None = None  # last stamp, and T_base_camera there

    def set_pose(self, pose: PoseWithCovariance, is_blind: bool = False) -> None:
        """
        Place the base at a pose ``T_odom_base``.

        The robot may have been carried there while the camera was lost: the motion of the camera
        since it was last tracked is not added then.

        :param is_blind: whether the camera's frames are not used either, as while paused.
        """
        self._pose = pose.copy()
        self._start = None
        self._is_moved |= not self._is_tracked
        if is_blind or self._is_lost:
            self._camera = None

    def mount(self, T_base_camera: np.ndarray) -> None:
        """Set the extrinsic of a first frame, 4x4, whose update is not added."""
        self._mounted = T_base_camera.copy()

    def update(self, update: OdometryUpdate, T_base_camera: np.ndarray,
               mount: Mount = Mount.FIXED) -> BaseUpdate | None:
        """
        Return pose and motion of the base at a frame, None where its stamp is not a newer one.

        :param T_base_camera: extrinsic at the frame, 4x4.
        :param mount: what it means if that differs from the one before.
        """
        if update.status is Status.BAD_STAMP:
            return None
        state = _state(update)
        self._is_lost = state is BaseState.LOST
        self._is_tracked = state not in (BaseState.LOST, BaseState.PREDICTED)
        if self._is_lost:
            return BaseUpdate(update.stamp, state, self.pose)
        T_base_camera = T_base_camera.copy()  # is kept
        motion = self._motion(update, T_base_camera, mount)
        if self._is_tracked and self._is_moved:  # what was predicted wrongly is not added
            self._is_moved, self._start, self._camera = False, None, None
        self._follow(update, T_base_camera, mount)
        if state is not BaseState.CONTINUED:  # the next motion begins where this one does
            self._measured = update.stamp, T_base_camera
        return BaseUpdate(update.stamp, state, self.pose,
                          motion if state in (BaseState.TRACKED, BaseState.CONTINUED) else None)

    def _follow(self, update: OdometryUpdate, T_base_camera: np.ndarray, mount: Mount) -> None:
        """Add the motion of the camera since the start to the pose of the base there."""
        camera = update.pose.copy()
        before = T_base_camera if self._mounted is None else self._mounted
        if mount is Mount.FIXED and not np.array_equal(before, T_base_camera):
            self._start, before = None, T_base_camera
        if self._is_new and update.level_start is not None:
            self._pose = _level(self._pose, update.level_start @ se3.inverse(before))
            self._camera = self._camera and PoseWithCovariance(update.level_start.copy())
        self._is_new = False
        if self._camera is None:
            self._camera, before = camera, T_base_camera
        if self._start is None:
            self._start = _Start(self._pose, self._camera, before)
        start = self._start
        self._pose = (start.base @ start.T_base_camera @ camera.since(start.camera)
                      @ se3.inverse(T_base_camera))
        self._camera, self._mounted = camera, T_base_camera

    def _motion(self, update: OdometryUpdate, T_base_camera: np.ndarray,
                mount: Mount) -> BaseMotion | None:
        """Return the motion of the base, None where the extrinsic at its start is not known."""
        increment = update.expected if update.increment is None else update.increment
        if increment is None:
            return None
        before = T_base_camera
        if mount is Mount.MOVING:
            start = update.stamp - round(increment.interval * NANOSECONDS)
            if self._measured is None or self._measured[0] != start:
                return None
            before = self._measured[1]
        moved = before @ increment.pose @ se3.inverse(T_base_camera)
        return BaseMotion.of(Increment(moved, increment.interval),
                             self._motion_model.change_of_twist(increment.interval))


def _level(pose: PoseWithCovariance, T_level_base: np.ndarray) -> PoseWithCovariance:
    """Return a pose with roll and pitch of another one, 4x4, and its own yaw."""
    turn = _yaw(pose.rotation) - _yaw(T_level_base)
    level = pose.matrix.copy()
    level[:3, :3] = se3.exp_rotation((0.0, 0.0, turn)) @ T_level_base[:3, :3]
    return PoseWithCovariance(level, pose.covariance)


def _yaw(rotation: np.ndarray) -> float:
    """Return the direction of the x axis in the plane [rad]."""
    return float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def _state(update: OdometryUpdate) -> BaseState:
    if update.status is Status.REPEATED:
        return BaseState.CONTINUED
    if update.status.ok:
        return BaseState.RECOVERED if update.recovered else BaseState.TRACKED
    return BaseState.PREDICTED if update.predicted else BaseState.LOST
