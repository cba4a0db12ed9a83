# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What comes into the node: images, their calibration and the camera's place on the robot."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo

from aick_ros.errors import InputError
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.messages.frame_decoder import FrameDecoder
from aick_ros.messages.synchronizer import Pair
from aick_ros.odometry.base_odometry import Mount
from aick_ros.ros.health.counts import Count
from aick_ros.ros.health.diagnostics import Diagnostics
from aick_ros.ros.input.calibrations import Calibration
from aick_ros.ros.input.extrinsics import Extrinsics
from aick_ros.ros.input.pairing import Pairing
from aick_ros.ros.input.subscriptions import (
    AdaptiveSubscription, camera_info_subscription, image_subscription)
from aick_ros.ros.input.watchdog import Watchdog
from aick_ros.settings.node import NodeSettings

_SILENCE = 0.5  # seconds after which no better partner is expected
_THROTTLE = 5.0  # seconds between two log lines of the same kind


class Arrival(NamedTuple):
    """A pair of images, the cameras as they were then (None: not known), the steady time [s]."""

    pair: Pair
    camera: Camera | None
    depth_camera: Camera | None
    paired_at: float


class Inputs:
    """
    Subscribes, and pairs images on the executor's thread; they are decoded where they are used.

    :param on_arrival: called with each pair.
    :param on_change: called when what a pair waits for may have come.
    :raises InputError: where a parameter cannot be used.
    """

    def __init__(self, node: Node, settings: NodeSettings, diagnostics: Diagnostics,
                 on_arrival: Callable[[Arrival], None], on_change: Callable[[], None]) -> None:
        self._logger = node.get_logger()
        self._settings = settings
        self._diagnostics = diagnostics
        self._on_arrival = on_arrival
        self._newest: Pair | None = None
        self._pairing = Pairing(settings, self._hand_on, self._refuse)
        self._decoder = FrameDecoder(settings.image_transport, settings.depth_transport)
        self._extrinsics = Extrinsics(node, settings, on_change)
        self._colour_info = Calibration(
            node, 'rgb/camera_info', 'rgb/image', settings, on_change)
        self._depth_info = Calibration(
            node, 'depth/camera_info', 'depth/image', settings, on_change)
        self._subscriptions = self._subscribe(node)
        self._watchdog = Watchdog(node, self._subscriptions, settings)
        # a steady timer: a /clock that stands still must not stop the watch
        node.create_timer(_SILENCE / 2, self._tend, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def counts(self) -> dict[Count, int]:
        """Images that could not be used, by cause."""
        return self._pairing.counts

    def is_ready(self, arrival: Arrival) -> bool:
        """Whether an arrival can be answered, or must not block the newest one, which can."""
        return '' in (self._missing_for(arrival.pair), self._missing_for(self._newest))

    def complaint(self) -> str:
        """Return what is missing, '' where nothing is."""
        return (self._watchdog.complaint()
                or (self._newest is not None and self._missing_for(self._newest))
                or self._watchdog.complaint_of_clocks(self._pairing.newest_stamp)
                or self._watchdog.complaint_of_losses(self._pairing.missing_shares))

    def frame(self, arrival: Arrival) -> RgbdFrame:
        """
        Decode a pair.

        :raises InputError: where its images cannot be used.
        """
        pair, camera = arrival.pair, arrival.camera or self._colour_info.camera
        if not self._settings.register_depth:
            return self._decoder.decode(pair, camera)
        return self._decoder.decode_and_reproject(
            pair, camera, arrival.depth_camera or self._depth_info.camera,
            self._extrinsics.depth_in_colour(
                pair.colour.header.frame_id, pair.depth.header.frame_id, pair.depth_stamp))

    def camera_in_base(self, arrival: Arrival) -> np.ndarray:
        """
        Return ``T_base_camera`` of a pair, 4x4; never called on the executor's thread.

        :raises InputError: naming both frames where it is not known.
        """
        pair = arrival.pair
        return self._extrinsics.camera_in_base(pair.colour.header.frame_id, pair.colour_stamp)

    def camera_mount(self, arrival: Arrival) -> Mount:
        """Return whether the camera of a pair moves on the base."""
        return self._extrinsics.camera_mount(arrival.pair.colour.header.frame_id)

    def find(self, target: str, source: str, stamp: int, wait: float = 0.0) -> np.ndarray | None:
        """Return ``T_target_source`` as TF tells it, as :meth:`Transforms.find` does."""
        return self._extrinsics.find(target, source, stamp, wait)

    def _subscribe(self, node: Node) -> dict[str, AdaptiveSubscription]:
        settings, pairing = self._settings, self._pairing
        subscriptions = [
            image_subscription(node, 'rgb/image', settings.image_transport, pairing.take_colour,
                               settings),
            image_subscription(node, 'depth/image', settings.depth_transport, pairing.take_depth,
                               settings),
            camera_info_subscription(node, 'rgb/camera_info', self._take_colour_info)]
        if settings.register_depth:
            subscriptions.append(camera_info_subscription(
                node, 'depth/camera_info', self._take_depth_info))
        return {subscription.name: subscription for subscription in subscriptions}

    def _take_colour_info(self, message: CameraInfo) -> None:
        if self._colour_info.take(message):
            self._watchdog.wants_no_more('rgb/camera_info')  # some drivers send it once

    def _take_depth_info(self, message: CameraInfo) -> None:
        if self._depth_info.take(message):
            self._watchdog.wants_no_more('depth/camera_info')

    def _refuse(self, sentence: str) -> None:
        self._diagnostics.count(Count.IMAGES_REJECTED)
        self._watchdog.refused(sentence)
        self._logger.warning(sentence, throttle_duration_sec=_THROTTLE)

    def _hand_on(self, pair: Pair) -> None:
        self._diagnostics.count(Count.RECEIVED)
        self._newest = pair
        self._watchdog.saw_pair()
        colour_frame, depth_frame = pair.colour.header.frame_id, pair.depth.header.frame_id
        if depth_frame != colour_frame and not self._settings.register_depth:
            self._logger.warning(
                f'depth images are of frame {depth_frame!r}, colour images of {colour_frame!r}: '
                'if the driver does not register depth to colour, set register_depth to true',
                once=True)
        self._on_arrival(Arrival(
            pair, self._colour_info.camera, self._depth_info.camera, time.monotonic()))

    def _tend(self) -> None:
        if self._watchdog.quiet_for() > _SILENCE:
            self._pairing.flush()
        for subscription in self._subscriptions.values():
            subscription.adapt()
        self._extrinsics.tend()

    def _missing_for(self, pair: Pair) -> str:
        """Return what a pair still needs before it can be registered, '' for nothing."""
        if self._colour_info.camera is None:
            return 'images come but no usable camera_info on rgb/camera_info'
        colour_frame = pair.colour.header.frame_id
        try:
            self._extrinsics.camera_in_base(colour_frame, pair.colour_stamp, wait=False)
            if self._settings.register_depth:
                if self._depth_info.camera is None:
                    return ('register_depth is set but no usable camera_info comes on '
                            'depth/camera_info')
                self._extrinsics.depth_in_colour(
                    colour_frame, pair.depth.header.frame_id, pair.depth_stamp, wait=False)
        except InputError as error:
            return str(error)
        return ''
