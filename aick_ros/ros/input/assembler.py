# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames from pairs of images, the calibrations of their cameras and their extrinsic."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from rclpy.node import Node
from sensor_msgs.msg import CameraInfo

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.messages.frame_decoder import FrameDecoder
from aick_ros.messages.synchronizer import Pair
from aick_ros.ros.input.calibration import Calibration
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.subscriptions import AdaptiveSubscription
from aick_ros.settings.node import NodeSettings


class Arrival(NamedTuple):
    """A pair of images, the cameras at that time (None: unknown), its steady time [s]."""

    pair: Pair
    camera: Camera | None
    depth_camera: Camera | None
    paired_at: float

    @property
    def camera_frame(self) -> str:
        """Frame of the colour image."""
        return str(self.pair.colour.header.frame_id)

    @property
    def size(self) -> int:
        """Size of both images [bytes]."""
        return len(self.pair.colour.data) + len(self.pair.depth.data)


class FrameAssembler:
    """
    Makes frames of pairs.

    :param on_change: called when a camera becomes known or changes.
    """

    def __init__(self, node: Node, settings: NodeSettings, extrinsics: Extrinsics,
                 on_change: Callable[[], None]) -> None:
        self._extrinsics = extrinsics
        self._decoder = FrameDecoder()
        self._colour = Calibration(node, 'rgb/camera_info', 'rgb/image', settings, on_change)
        self._depth = Calibration(
            node, 'depth/camera_info', 'depth/image', settings, on_change
        ) if settings.register_depth else None

    @property
    def subscriptions(self) -> list[AdaptiveSubscription]:
        """The subscriptions of the calibrations, none for those that come with the images."""
        return [calibration.subscription for calibration in (self._colour, self._depth)
                if calibration is not None and calibration.subscription is not None]

    def take_camera_infos(self, colour: CameraInfo, depth: CameraInfo) -> None:
        """Take the calibrations that came with a pair of images."""
        self._colour.take(colour)
        if self._depth is not None:
            self._depth.take(depth)

    def arrival(self, pair: Pair) -> Arrival:
        """Return a pair with the cameras as they are now."""
        depth_camera = None if self._depth is None else self._depth.camera
        return Arrival(pair, self._colour.camera, depth_camera, time.monotonic())

    def missing_for(self, pair: Pair) -> str:
        """Return what a pair needs before it can be registered, '' for nothing."""
        if self._colour.camera is None:
            return (f'images come but no usable camera_info on {self._colour.place}: '
                    f'{self._colour.remedy}')
        colour_frame = pair.colour.header.frame_id
        try:
            self._extrinsics.camera_in_base(colour_frame, pair.colour_stamp, wait=False)
            if self._depth is not None:
                if self._depth.camera is None:
                    return ('register_depth is set but no usable camera_info comes on '
                            f'{self._depth.place}: {self._depth.remedy}')
                self._extrinsics.depth_in_colour(
                    colour_frame, pair.depth.header.frame_id, pair.depth_stamp, wait=False)
        except InputError as error:
            return str(error)
        return ''

    def frame(self, arrival: Arrival) -> RgbdFrame:
        """
        Return the frame of a pair; it may wait for TF: not for the executor's thread.

        :raises InputError: where the images cannot be used.
        """
        pair, camera = arrival.pair, arrival.camera or self._colour.camera
        if camera is None:
            raise InputError(self.missing_for(pair))
        if self._depth is None:
            return self._decoder.decode(pair, camera)
        depth_camera = arrival.depth_camera or self._depth.camera
        if depth_camera is None:
            raise InputError(self.missing_for(pair))
        return self._decoder.decode_and_reproject(
            pair, camera, depth_camera, self._extrinsics.depth_in_colour(
                arrival.camera_frame, pair.depth.header.frame_id, pair.depth_stamp))
