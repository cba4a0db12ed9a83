# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Where the cameras sit: from TF, or from parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from rclpy.node import Node

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.odometry.base_odometry import Mount
from aick_ros.ros.input import transforms
from aick_ros.settings.node import NodeSettings


class Extrinsics:
    """
    The colour camera in the robot's base, and the depth camera in the colour camera.

    :param on_change: called when a transform has come.
    :raises InputError: where a parameter is no pose.
    """

    def __init__(self, node: Node, settings: NodeSettings, on_change: Callable[[], None]) -> None:
        self._base_frame = settings.frame_id
        self._wait = settings.wait_for_transform
        self._T_base_camera = _pose('camera_in_base', settings.camera_in_base)
        self._T_colour_depth = _pose('depth_in_colour', settings.depth_in_colour)
        self._transforms = transforms.Transforms(
            node, (settings.odom_frame_id, settings.guess_frame_id or settings.frame_id),
            on_change)
        self.find = self._transforms.find

    def tend(self) -> None:
        """Listen to what is needed; to be called now and then on the executor's thread."""
        self._transforms.tend()

    def camera_in_base(self, camera_frame: str, stamp: int, wait: bool = True) -> np.ndarray:
        """
        Return ``T_base_camera`` at a stamp [ns], 4x4, never a guess.

        :param wait: whether to wait for moving links; never on the executor's thread.
        :raises InputError: naming both frames where nothing connects them yet.
        """
        if self._T_base_camera is not None:
            return self._T_base_camera
        found = self._transforms.find(
            self._base_frame, camera_frame, stamp, self._wait if wait else 0.0)
        if found is None:
            raise InputError(
                f'no transform from {camera_frame!r} (the colour image) to {self._base_frame!r} '
                f'(frame_id) yet: {_remedy()}, or set camera_in_base, or set frame_id to '
                f'{camera_frame!r}')
        return found

    def camera_mount(self, camera_frame: str) -> Mount:
        """Return whether links between the camera and the base move."""
        if self._T_base_camera is not None or self._transforms.is_fixed(
                self._base_frame, camera_frame):
            return Mount.FIXED
        return Mount.MOVING

    def depth_in_colour(self, colour_frame: str, depth_frame: str, stamp: int,
                        wait: bool = True) -> np.ndarray:
        """Return ``T_colour_depth`` at a stamp [ns], 4x4; otherwise as ``camera_in_base``."""
        if self._T_colour_depth is not None:
            return self._T_colour_depth
        found = self._transforms.find(
            colour_frame, depth_frame, stamp, self._wait if wait else 0.0)
        if found is None:
            raise InputError(
                f'no transform from {depth_frame!r} (the depth image) to {colour_frame!r} (the '
                f'colour image) yet: {_remedy()}, or set depth_in_colour')
        return found


def _remedy() -> str:
    if transforms.TFMessage is None:
        return 'tf2_msgs is not installed, so TF cannot be asked'
    return 'publish the static transform between them'


def _pose(name: str, numbers: Sequence[float]) -> np.ndarray | None:
    if not numbers:
        return None
    try:
        x, y, z, *quaternion = numbers
        return se3.from_quaternion(quaternion, (x, y, z))
    except ValueError:
        raise InputError(
            f'{name} = {list(numbers)} is no pose: it takes x y z qx qy qz qw') from None
