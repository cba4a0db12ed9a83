# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What comes into the node: images, their calibration and the camera's place on the robot."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image

from aick_ros import image_codec, rigid
from aick_ros.camera import Camera
from aick_ros.errors import InputError
from aick_ros.frame import RgbdFrame
from aick_ros.ros.diagnostics import Diagnostics
from aick_ros.ros.messages import to_stamp
from aick_ros.ros.transforms import StaticTransforms
from aick_ros.ros.watchdog import Watchdog
from aick_ros.settings import NodeSettings
from aick_ros.synchronizer import Pair, Synchronizer

_SILENCE = 0.5  # seconds after which no better partner is expected
_THROTTLE = 5.0  # seconds between two log lines of the same kind


class Arrival(NamedTuple):
    """A pair of images, the camera as it was then (None: not known yet), the steady time [s]."""

    pair: Pair
    camera: Camera | None
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
        self._diagnostics = diagnostics
        self._on_arrival, self._on_change = on_arrival, on_change
        self._camera: Camera | None = None
        self._newest: Pair | None = None
        self._synchronizer = Synchronizer(
            settings.approx_sync_max_interval if settings.approx_sync else 0.0,
            settings.sync_queue_size)
        self._extrinsics = StaticTransforms(
            node, settings.frame_id, _given_extrinsic(settings), on_change)
        self._watchdog = Watchdog(node, self._subscribe(node, settings), settings)
        # a steady timer: a /clock that stands still must not stop the watch
        node.create_timer(_SILENCE / 2, self._flush, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @property
    def counts(self) -> dict[str, int]:
        """How many images were left out, by cause."""
        unpaired = self._synchronizer.unpaired
        return {'colour_images_without_depth': unpaired['colour'],
                'depth_images_without_colour': unpaired['depth']}

    def is_ready(self, arrival: Arrival) -> bool:
        """Whether an arrival can be answered, or must not block the newest one, which can."""
        return '' in (self._missing_for(arrival.pair), self._missing_for(self._newest))

    def complaint(self) -> str:
        """Return what is missing, '' where nothing is."""
        complaint = self._watchdog.complaint()
        if not complaint and self._newest is not None:
            complaint = self._missing_for(self._newest)
        return complaint

    def frame(self, arrival: Arrival) -> RgbdFrame:
        """
        Decode a pair.

        :raises InputError: where its images cannot be used.
        """
        pair = arrival.pair
        return RgbdFrame(pair.colour_stamp, image_codec.colour_image(pair.colour),
                         image_codec.depth_image(pair.depth), arrival.camera or self._camera,
                         pair.depth_stamp)

    def camera_in_base(self, arrival: Arrival) -> np.ndarray:
        """
        Return ``T_base_camera`` of a pair, 4x4.

        :raises InputError: naming both frames where it is not known.
        """
        return self._extrinsics.camera_in_base(arrival.pair.colour.header.frame_id)

    def _subscribe(self, node: Node, settings: NodeSettings) -> dict[str, Any]:
        qos = QoSProfile(depth=settings.topic_queue_size,
                         reliability=ReliabilityPolicy[settings.qos_reliability.upper()])
        return {name: node.create_subscription(kind, name, callback, qos)
                for name, kind, callback in (
                    ('rgb/image', Image, self._take_colour),
                    ('depth/image', Image, self._take_depth),
                    ('rgb/camera_info', CameraInfo, self._take_camera_info))}

    def _take_colour(self, message: Image) -> None:
        self._watchdog.saw('rgb/image')
        self._take(self._synchronizer.add_colour, message)

    def _take_depth(self, message: Image) -> None:
        self._watchdog.saw('depth/image')
        self._take(self._synchronizer.add_depth, message)

    def _take_camera_info(self, message: CameraInfo) -> None:
        try:
            camera = Camera.from_camera_info(
                message.width, message.height, message.k, message.d, message.distortion_model)
        except InputError as error:
            self._logger.warning(
                f'camera_info refused: {error}', throttle_duration_sec=_THROTTLE)
            return
        self._watchdog.wants_no_more('rgb/camera_info')  # some drivers send it once
        if camera != self._camera:
            self._camera = camera
            self._logger.info(f'camera: {camera}')
            self._on_change()

    def _take(self, add: Callable[[int, Image], list[Pair]], image: Image) -> None:
        stamp, late = to_stamp(image.header.stamp), self._synchronizer.late
        if stamp <= 0:
            self._refuse(f'image left out: its stamp is {stamp} ns; the driver must stamp its '
                         'images')
            return
        self._hand_on(add(stamp, image))
        if self._synchronizer.late > late:
            self._refuse(f'image of {stamp} ns left out: its stamp repeats or goes back; is the '
                         'driver publishing twice?')

    def _refuse(self, sentence: str) -> None:
        self._diagnostics.count('images refused')
        self._watchdog.refused(sentence)
        self._logger.warning(sentence, throttle_duration_sec=_THROTTLE)

    def _hand_on(self, pairs: list[Pair]) -> None:
        for pair in pairs:
            self._diagnostics.count('frames received')
            self._newest = pair
            self._watchdog.saw_pair()
            self._on_arrival(Arrival(pair, self._camera, time.monotonic()))

    def _flush(self) -> None:
        if self._watchdog.quiet_for() > _SILENCE:
            self._hand_on(self._synchronizer.flush())

    def _missing_for(self, pair: Pair) -> str:
        """Return what a pair still needs before it can be registered, '' for nothing."""
        if self._camera is None:
            return 'images come but no usable camera_info on rgb/camera_info'
        try:
            self._extrinsics.camera_in_base(pair.colour.header.frame_id)
        except InputError as error:
            return str(error)
        return ''


def _given_extrinsic(settings: NodeSettings) -> np.ndarray | None:
    numbers = settings.camera_in_base
    if not numbers:
        return None
    try:
        x, y, z, *quaternion = numbers
        return rigid.from_quaternion(quaternion, (x, y, z))
    except ValueError:
        raise InputError(f'camera_in_base = {list(numbers)} is no pose: it takes x y z qx qy qz '
                         'qw') from None
