# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Poses of the cameras on the robot, from parameters or from TF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.borders.limits import MAX_EXTRINSIC
from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.frame_tree import LARGEST_GAP, FrameTransform
from aick_ros.odometry.base_odometry import Mount
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.tf_messages import TF_REMEDY
from aick_ros.settings.node import NodeSettings


@dataclass(frozen=True, eq=False)
class Extrinsic:
    """
    Pose of a camera on the base at one stamp.

    :param T_base_camera: 4x4; where it is that of others too, nobody can change it.
    :param mount: whether the camera moves on the base, by the links that give the pose.
    """

    T_base_camera: np.ndarray
    mount: Mount


class Extrinsics:
    """
    Pose of the colour camera in the base, and of the depth camera in the colour camera.

    :raises InputError: where a parameter is no pose.
    """

    def __init__(self, transforms: Transforms, settings: NodeSettings) -> None:
        self._transforms = transforms
        self._base_frame = settings.frame_id
        self._wait = settings.wait_for_transform
        self._T_base_camera = _pose('camera_in_base', settings.camera_in_base)
        self._T_colour_depth = _pose('depth_in_colour', settings.depth_in_colour)

    def camera_in_base(self, camera_frame: str, stamp: int, wait: bool = True) -> Extrinsic:
        """
        Return pose and mount of the colour camera at a stamp; neither is ever guessed.

        :param camera_frame: frame of the colour images.
        :param stamp: [ns].
        :param wait: whether to wait for moving links; never on the executor's thread. Without,
            their last sample counts that is up to 0.5 s before the stamp.
        :raises InputError: naming both frames where they are not connected yet.
        """
        if self._T_base_camera is not None:
            return Extrinsic(self._T_base_camera, Mount.FIXED)
        if not camera_frame:
            raise InputError('the colour image has no frame_id: let the driver set it, or set '
                             'camera_in_base')
        found = self._find(self._base_frame, camera_frame, stamp, wait)
        if found is None:
            raise InputError(
                f'no transform from {quoted(camera_frame)} (the colour image) to '
                f'{quoted(self._base_frame)} (frame_id) yet: {TF_REMEDY}, or set '
                f'camera_in_base, or set frame_id to {quoted(camera_frame)}')
        return Extrinsic(_near(found, camera_frame, self._base_frame),
                         Mount.FIXED if found.is_static else Mount.MOVING)

    def depth_in_colour(self, colour_frame: str, depth_frame: str, stamp: int,
                        wait: bool = True) -> np.ndarray:
        """
        Return ``T_colour_depth`` at a stamp, 4x4.

        :param colour_frame: frame of the colour images; ``depth_frame`` of the depth images.
        :param stamp: [ns].
        :param wait: whether to wait for moving links; never on the executor's thread. Without,
            their last sample counts that is up to 0.5 s before the stamp.
        :raises InputError: naming both frames where they are not connected yet.
        """
        if self._T_colour_depth is not None:
            return self._T_colour_depth
        found = self._find(colour_frame, depth_frame, stamp, wait)
        if found is None:
            raise InputError(
                f'no transform from {quoted(depth_frame)} (the depth image) to '
                f'{quoted(colour_frame)} (the colour image) yet: {TF_REMEDY}, or '
                'set depth_in_colour')
        return _near(found, depth_frame, colour_frame)

    def _find(self, target: str, source: str, stamp: int, wait: bool) -> FrameTransform | None:
        if wait:
            return self._transforms.find(target, source, stamp, self._wait)
        return self._transforms.find(target, source, stamp, 0.0, LARGEST_GAP)


def _near(found: FrameTransform, source: str, target: str) -> np.ndarray:
    """
    Return ``T_target_source`` of a transform that may be an extrinsic, 4x4.

    :raises InputError: where it is longer than any machine: the pose of the base would be that of
        a lever of this length, and stay so after the transform has been corrected.
    """
    distance = float(np.linalg.norm(found.T_target_source[:3, 3]))
    if distance > MAX_EXTRINSIC:
        raise InputError(f'the transform from {quoted(source)} to {quoted(target)} is '
                         f'{distance:.3g} m long, at most {MAX_EXTRINSIC:g} m are possible: '
                         'check its publisher')
    return found.T_target_source


def _pose(name: str, numbers: Sequence[float]) -> np.ndarray | None:
    if not numbers:
        return None
    try:
        x, y, z, *quaternion = numbers
        pose = se3.from_quaternion(quaternion, (x, y, z))
    except ValueError:
        raise InputError(
            f'{name} = {list(numbers)} is no pose: x y z qx qy qz qw are required') from None
    if np.linalg.norm(pose[:3, 3]) > MAX_EXTRINSIC:
        raise InputError(f'{name} = {list(numbers)} is more than {MAX_EXTRINSIC:g} m away: its '
                         'unit is metres')
    pose.flags.writeable = False
    return pose
