# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The cameras of a bag: their calibrations, and where the depth camera is."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.geometry.frame_tree import FrameTree
from aick_ros.messages.camera_info import is_rectified
from aick_ros.sources import SourceOptions, raise_damage
from aick_ros.sources.bag_calibration import BagCalibration, camera_of
from aick_ros.sources.bag_file import BagFile
from aick_ros.sources.bag_topics import TRANSFORMS, BagTopics
from aick_ros.sources.calibration import BY_OPTION, read_camera

_STATIC_TRANSFORMS = '/tf_static'
_CAMERA_REMEDY = f'or give a calibration {BY_OPTION}'
_DEPTH_REMEDY = 'or choose another one with --depth-info-topic'


class BagCameras:
    """
    Finds the calibrations and the extrinsic of the two cameras of a bag.

    :param topics: of the bag, whose name is in the errors.
    :raises InputError: where an option has no effect or is no pose.
    """

    def __init__(self, bag: BagFile, topics: BagTopics, options: SourceOptions) -> None:
        self._bag, self._topics, self._options = bag, topics, options
        if not options.register_depth and options.depth_info_topic is not None:
            raise InputError('--depth-info-topic has no effect without --register-depth')
        if not options.register_depth and options.depth_in_colour is not None:
            raise InputError('--depth-in-colour has no effect without --register-depth')
        self._T_colour_depth = _given_pose(options)

    def colour(self, images: str) -> Camera:
        """
        Return the camera of the colour images on a topic.

        :raises InputError: where it is not described.
        """
        if self._options.camera is not None:
            return read_camera(self._options.camera)
        try:
            info = self._topics.info(self._options.info_topic, images)
        except InputError as error:
            raise InputError(f'{error}; {_CAMERA_REMEDY}') from None
        return self._camera(info, images, _CAMERA_REMEDY)

    def depth(self, images: str) -> Camera:
        """
        Return the camera of the depth images on a topic, whose depth is not registered.

        :raises InputError: where it is not described.
        """
        info = self._topics.depth_info(self._options.depth_info_topic, images)
        return self._camera(info, images, _DEPTH_REMEDY)

    def calibrations(self, colour: str, depth: str, first: Sequence[Camera]
                     ) -> list[BagCalibration]:
        """
        Return the calibrations that follow the camera_info of the colour and the depth images.

        :param colour: topic of the colour images; depth likewise.
        :param first: cameras of both at the start; the colour camera alone: only its calibration.
        """
        info = None
        if self._options.camera is None:
            info = self._topics.info(self._options.info_topic, colour)
        found = [BagCalibration(first[0], info, is_rectified(colour), _CAMERA_REMEDY)]
        for camera in first[1:]:
            info = self._topics.depth_info(self._options.depth_info_topic, depth)
            found.append(BagCalibration(camera, info, is_rectified(depth), _DEPTH_REMEDY))
        return found

    def depth_in_colour(self, colour_frame: str, depth_frame: str) -> np.ndarray:
        """
        Return ``T_colour_depth``, 4x4: the option's, or that of fixed transforms in the bag.

        :raises InputError: naming both frames where nothing connects them.
        """
        if self._T_colour_depth is not None:
            return self._T_colour_depth
        colour, depth = colour_frame.lstrip('/'), depth_frame.lstrip('/')
        found = self._frames.find(colour, depth, 0)
        if found is None:
            raise InputError(
                f'{self._topics.bag} has no transform from {depth!r} (the depth images) to '
                f'{colour!r} (the colour images) on {_STATIC_TRANSFORMS}: give it with '
                '--depth-in-colour X Y Z QX QY QZ QW')
        return found.T_target_source

    def in_colour(self, colour_frame: str, sensor_frame: str) -> np.ndarray | None:
        """Return ``T_colour_sensor``, 4x4, by fixed transforms in the bag; None: not known."""
        colour, sensor = colour_frame.lstrip('/'), sensor_frame.lstrip('/')
        if colour == sensor:
            return np.eye(4)
        found = self._frames.find(colour, sensor, 0)
        return None if found is None else found.T_target_source

    def _camera(self, topic: str, images: str, remedy: str) -> Camera:
        for message in self._bag.messages([topic], raise_damage):
            try:
                return camera_of(message.content, is_rectified(images))
            except InputError as error:
                raise InputError(f'{self._topics.bag}, {topic}: {error}; {remedy}') from None
        raise InputError(f'{self._topics.bag} has no message on {topic}: record it again, '
                         f'{remedy}')

    @cached_property
    def _frames(self) -> FrameTree:
        """The fixed transforms of the bag; null quaternions are skipped."""
        tree = FrameTree()
        has_some = self._topics.types.get(_STATIC_TRANSFORMS) == TRANSFORMS
        topics = [_STATIC_TRANSFORMS] if has_some else []
        for message in self._bag.messages(topics, raise_damage):
            for link in message.content.transforms:
                position, rotation = link.transform.translation, link.transform.rotation
                try:
                    T_parent_child = se3.from_quaternion(
                        (rotation.x, rotation.y, rotation.z, rotation.w),
                        (position.x, position.y, position.z))
                except ValueError:
                    continue
                # tf of ROS 1 set a slash in front of the names
                tree.set_static(link.header.frame_id.lstrip('/'), link.child_frame_id.lstrip('/'),
                                T_parent_child)
        return tree


def _given_pose(options: SourceOptions) -> np.ndarray | None:
    numbers = options.depth_in_colour
    if numbers is None:
        return None
    try:
        x, y, z, *quaternion = numbers
        return se3.from_quaternion(quaternion, (x, y, z))
    except ValueError:
        raise InputError(f'--depth-in-colour {" ".join(map(str, numbers))} is no pose: x y z qx '
                         'qy qz qw are required') from None
