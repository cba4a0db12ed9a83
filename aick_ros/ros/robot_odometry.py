# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Odometry of the robot: that of its camera, with all that the node knows of the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.pose import PoseWithCovariance
from aick_ros.odometry import Odometry, OdometryUpdate
from aick_ros.odometry.base_odometry import BaseOdometry, BaseUpdate
from aick_ros.odometry.level_start import LevelWait
from aick_ros.registration.preparation import Preparation
from aick_ros.registration.status import Status
from aick_ros.ros.health.camera_report import CameraReport
from aick_ros.ros.health.sentences import joined
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.guess import Guess, StartByGuess
from aick_ros.ros.input.imu import ImuInput
from aick_ros.ros.parameters import initial_pose
from aick_ros.settings import NodeSettings, Settings


@dataclass(frozen=True, eq=False)
class RobotUpdate:
    """
    Motion of the camera and of the base at one frame.

    :param frame: with its images as the camera sent them.
    :param camera_frame: frame of the images.
    :param camera: update of the camera.
    :param base: update of the base; None where the stamp is not a newer one, or it is held back.
    :param T_odom_base: pose of the base, 4x4; without an update the last one.
    :param T_base_camera: extrinsic, 4x4.
    """

    frame: RgbdFrame
    camera_frame: str
    camera: OdometryUpdate
    base: BaseUpdate | None
    T_odom_base: np.ndarray
    T_base_camera: np.ndarray


class RobotOdometry:
    """
    Follows the base by the frames of its camera, an IMU and a guess.

    It is for one thread; another one may prepare frames, or ask for properties.

    :param guess: None: there is none.
    :param log: called with what is found out about the camera.
    """

    def __init__(self, settings: NodeSettings, core: Settings, extrinsics: Extrinsics,
                 imu: ImuInput, guess: Guess | None, log: Callable[[str], object]) -> None:
        self._extrinsics, self._imu, self._guess = extrinsics, imu, guess
        self._start = StartByGuess(guess, settings)
        self._camera = Odometry(core)
        self._base = BaseOdometry(initial_pose(settings), core.odometry)
        self._camera_report = CameraReport(log)
        self._wait = (LevelWait(self._camera, core.imu) if settings.wait_level_to_init else None)
        self._is_held = False  # what the last frame has shown

    def prepare(self, frame: RgbdFrame) -> Preparation:
        """Return what registration needs of a frame alone."""
        return self._camera.prepare(frame)

    def register(self, preparation: Preparation, camera_frame: str) -> RobotUpdate:
        """
        Return the motion at a frame; it may wait for TF: not for the executor's thread.

        :param camera_frame: frame of the colour images.
        :raises InputError: where the frame cannot be used, or has to wait at the start.
        """
        stamp = preparation.frame.stamp
        extrinsic = self._extrinsics.camera_in_base(camera_frame, stamp)  # waits for /tf
        start = self._start.pose(stamp)
        # after both: where one of them rejects the frame, its samples are left to the next one
        samples = self._imu.samples(camera_frame, stamp)
        if samples is not None:
            preparation.add_imu(samples)
        if start is not None:
            self._base.reset(start)
        if self._guess is None:
            update = self._camera.register(preparation, T_base_camera=extrinsic.T_base_camera)
        else:
            update = self._camera.register(
                preparation, partial(self._guess.camera_motion, camera_frame),
                extrinsic.T_base_camera)
        if update.status.ok:
            self._start.cancel()
        self._camera_report.update(self._camera.misalignment, self._camera.distortion)
        update = self._begun_level(update)
        base = None
        if not self._is_held:
            base = self._base.update(update, extrinsic.T_base_camera, extrinsic.mount)
        elif update.status is Status.FIRST_FRAME:
            self._base.mount(extrinsic.T_base_camera)
        return RobotUpdate(preparation.frame, camera_frame, update, base,
                           self._base.pose.matrix, extrinsic.T_base_camera)

    def _begun_level(self, update: OdometryUpdate) -> OdometryUpdate:
        """Return an update in the level frame; note whether it is held back till that is known."""
        if self._wait is None:
            return update
        if self._wait.is_interrupted:
            self._wait.end()  # for the frames before, which were not published
        self._is_held = self._wait.goes_on(update.stamp)
        turn = None if self._is_held else self._wait.end()
        return update if turn is None else update.turned(turn)

    def reset(self, pose: PoseWithCovariance | None) -> None:
        """Begin anew at ``T_odom_base``; None: at the origin or at the guess."""
        self._camera.reset()
        self._base.reset(pose)
        self._is_held = False
        if self._wait is not None:
            self._wait.restart()
        if pose is None:
            self._start.reset()
        else:
            self._start.cancel()

    def set_pose(self, pose: PoseWithCovariance, is_blind: bool) -> None:
        """
        Continue from ``T_odom_base``.

        :param is_blind: whether the camera's frames are not used meanwhile.
        """
        self._base.set_pose(pose, is_blind or self._is_held)
        self._start.cancel()

    def change_settings(self, settings: Settings) -> None:
        """Continue with other settings."""
        self._camera.change_settings(settings)
        self._base.configure(settings.odometry)
        if self._wait is not None:
            self._wait.configure(settings.imu)

    def local_map(self) -> np.ndarray:
        """Return the keypoints of the keyframes in the camera's frame, Nx3 [m]."""
        return self._camera.local_map()

    @property
    def complaint(self) -> str:
        """Why the IMU is not used, '' where it is, or there is none."""
        return joined(self._imu.complaint, self._camera.gyroscope.complaint,
                      self._camera.gravity.complaint)

    @property
    def concern(self) -> str:
        """Wait for a guess, or for what is up, or a plane that is none, in words; '' for none."""
        return joined('' if self._guess is None else self._guess.complaint,
                      '' if self._wait is None else self._wait.complaint,
                      self._camera.plane.complaint)

    @property
    def findings(self) -> dict[str, str]:
        """State of camera and IMU in words, by key."""
        return {'misalignment of the camera': self._camera_report.misalignment,
                'distortion of depth images': self._camera_report.distortion,
                'gyroscope': self._camera.gyroscope.description,
                'accelerometer': self._camera.gravity.description}
