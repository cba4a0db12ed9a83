# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The topic of an IMU: samples for each frame, in the axes of the camera."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.timer import Timer
from sensor_msgs.msg import Imu

from aick_ros.borders.names import quoted
from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.messages.imu import ImuBuffer
from aick_ros.messages.imu_cdr import read_imu
from aick_ros.messages.imu_clock import ImuClock
from aick_ros.ros.conversions import to_stamp
from aick_ros.ros.input.polled_subscription import PolledSubscription
from aick_ros.ros.input.transforms import Transforms
from aick_ros.ros.tf_messages import TF_REMEDY

_QUEUE = 4000  # messages; chosen: four seconds at 1 kHz, as without images they are taken once
_POLL_INTERVAL = 0.005  # s; chosen: an image waits for its samples and at most this longer
_LATEST = NANOSECONDS // 20  # chosen: longer than a sample takes to arrive
_SILENT = 1.0  # s; chosen


class ImuInput:
    """
    Receives the samples of an IMU when an image, a frame or a report needs them.

    While an image waits for samples that are about to come, a timer on the executor's thread
    takes them.

    :param on_change: called when the samples that a frame waits for have arrived.
    :param is_required: whether the first frame waits for the first sample.
    """

    def __init__(self, node: Node, transforms: Transforms, on_change: Callable[[], None],
                 is_required: bool = False) -> None:
        self._transforms, self._on_change = transforms, on_change
        self._is_required = is_required
        self._buffer = ImuBuffer()
        self._received_at = 0.0
        self._lock = threading.Lock()
        self._awaited: int | None = None  # stamp of the first image that waits [ns]
        self._missing = ''  # which transform is missing, in one sentence
        self._clock = ImuClock()
        self._node = node
        self._subscription: PolledSubscription | None = None
        self._timer: Timer | None = None

    def activate(self) -> None:
        """Subscribe."""
        self._subscription = PolledSubscription(
            self._node, Imu, 'imu',
            # matches every publisher; a lost sample is bridged
            QoSProfile(depth=_QUEUE, reliability=ReliabilityPolicy.BEST_EFFORT))
        self._timer = self._node.create_timer(
            _POLL_INTERVAL, self._poll, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._timer.cancel()

    def deactivate(self) -> None:
        """Unsubscribe."""
        with self._lock:
            if self._subscription is not None:
                self._subscription.destroy()
            if self._timer is not None:
                self._node.destroy_timer(self._timer)
            self._subscription = self._timer = self._awaited = None

    @property
    def complaint(self) -> str:
        """Why the IMU is not used, in one sentence; '' where it is, or there is none."""
        self._receive()
        topic = self._node.resolve_topic_name('imu')
        if self._buffer.newest is None:
            return (f'the first frame waits for the IMU on {topic}, by wait_imu_to_init'
                    if self._is_required else '')
        silence = time.monotonic() - self._received_at
        if silence > _SILENT:
            return f'no sample of the IMU has come on {topic} for {silence:.0f} s'
        return self._missing or self._clock.complaint(topic) or self._buffer.complaint(topic)

    def compare_clock(self, stamp: int) -> None:
        """
        Compare the clock of the samples with that of the images.

        :param stamp: of a colour image that has just come [ns], whether or not it finds a partner.
        """
        self._receive()
        newest = self._buffer.newest
        if newest is not None:
            self._clock.compare(stamp, newest)

    def reaches(self, stamp: int) -> bool:
        """
        Return whether the samples up to the stamp of an image [ns] have arrived.

        A late IMU is not waited for, nor one that is silent; the first sample is, if required.
        ``on_change`` is called for the first of several images; a later one is asked for again.
        """
        self._receive()
        with self._lock:
            if self._has_arrived(stamp):
                if self._awaited is not None and self._awaited <= stamp:
                    self._awaited = None  # the images before this one no longer wait
                return True
            self._awaited = stamp if self._awaited is None else min(self._awaited, stamp)
            if self._timer is not None:
                self._timer.reset()
            return False

    def _has_arrived(self, stamp: int) -> bool:
        newest = self._buffer.newest
        if newest is None:
            return not self._is_required
        return not 0 < stamp - newest < _LATEST

    def samples(self, camera_frame: str, stamp: int) -> ImuSamples | None:
        """
        Return the samples since the frame before, None where there is no IMU.

        :param camera_frame: of the colour image.
        :param stamp: of the image [ns].
        :raises InputError: where the first ones are required and their transform is missing.
        """
        self._receive()
        if self._buffer.newest is None:
            return None
        imu_frame = self._buffer.frame_id
        try:
            found = self._transforms.find(camera_frame, imu_frame, stamp)
            self._missing = '' if found is not None else (
                f'no transform from {quoted(imu_frame)} (the IMU) to {quoted(camera_frame)} (the '
                f'colour image) yet: {TF_REMEDY}; until then the IMU is not used')
        except InputError as error:
            found, self._missing = None, str(error)
        if found is None:
            if self._is_required:
                raise InputError(self._missing)
            return None
        self._is_required = False
        return self._buffer.take(found.T_target_source)

    def _poll(self) -> None:
        """Take the samples that an image waits for."""
        self._receive()
        with self._lock:
            if self._awaited is not None and not self._has_arrived(self._awaited):
                return
            is_awaited, self._awaited = self._awaited is not None, None
            if self._timer is not None:
                self._timer.cancel()
        if is_awaited:
            self._on_change()

    def _receive(self) -> None:
        """Take all samples that have come."""
        with self._lock:
            messages = [] if self._subscription is None else self._subscription.take()
            for serialized in messages:
                fields = read_imu(serialized)
                if fields is not None:
                    self._buffer.add_fields(fields)
                else:
                    message = deserialize_message(serialized, Imu)
                    self._buffer.add(to_stamp(message.header.stamp), message)
        if messages:
            self._received_at = time.monotonic()
