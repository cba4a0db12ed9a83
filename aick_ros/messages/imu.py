# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""sensor_msgs/Imu, live or from a bag, to samples that wait for their frame."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from threading import Lock
from typing import Protocol

import numpy as np

from aick_ros.borders.limits import MAX_ACCELERATION, MAX_TURN_RATE
from aick_ros.frames.imu import ImuSamples
from aick_ros.messages.imu_cdr import ImuFields

_NOT_MEASURED = [np.nan, np.nan, np.nan]
_UNMEASURED = 100  # samples; chosen: half a second at 200 Hz, some drivers begin with a few
_MOST = 60_000  # chosen: a minute at 1 kHz; older samples are forgotten


class _Header(Protocol):
    frame_id: str


class _Vector(Protocol):
    x: float
    y: float
    z: float


class ImuMessage(Protocol):
    """The fields of a sensor_msgs/Imu that are read."""

    header: _Header
    angular_velocity: _Vector
    angular_velocity_covariance: np.ndarray
    linear_acceleration: _Vector
    linear_acceleration_covariance: np.ndarray


class ImuBuffer:
    """Samples that wait for the next frame, in the axes of the sensor; for two threads."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._rows: deque[tuple[float, ...]] = deque(maxlen=_MOST)
        self._stamps: deque[int] = deque(maxlen=_MOST)
        self.newest: int | None = None
        """Stamp of the last sample [ns]; None before the first one."""
        self._unmeasured = 0  # samples since one with a measurement
        self.frame_id = ''
        """Frame of the sensor."""

    def add(self, stamp: int, message: ImuMessage) -> None:
        """Add a message with its stamp [ns]."""
        turn, force = message.angular_velocity, message.linear_acceleration
        self.add_fields(ImuFields(
            stamp, message.header.frame_id,
            (turn.x, turn.y, turn.z, message.angular_velocity_covariance[0]),
            (force.x, force.y, force.z, message.linear_acceleration_covariance[0])))

    def add_fields(self, fields: ImuFields) -> None:
        """
        Add a sample.

        A negative first covariance says that a vector is not measured, by definition of the
        message; drivers with a topic for each sensor leave the other one zero. Nor is one measured
        that no sensor reaches.
        """
        (*rate, rate_covariance), (*force, force_covariance) = fields.rate, fields.acceleration
        if rate_covariance < 0.0 or not _is_within(rate, MAX_TURN_RATE):
            rate = _NOT_MEASURED
        if force_covariance < 0.0 or not any(force) or not _is_within(force, MAX_ACCELERATION):
            force = _NOT_MEASURED
        with self._lock:
            self._stamps.append(fields.stamp)
            self._rows.append((*rate, *force))
            is_empty = rate is _NOT_MEASURED and force is _NOT_MEASURED
            self._unmeasured = self._unmeasured + 1 if is_empty else 0
            self.newest, self.frame_id = fields.stamp, fields.frame_id

    def complaint(self, topic: str) -> str:
        """Return that the samples measure nothing, in one sentence; '' where they do."""
        if self._unmeasured < _UNMEASURED:
            return ''
        return (f'the last {self._unmeasured} samples of the IMU on {topic} have neither a turn '
                'rate nor an acceleration (they are not numbers, beyond what sensors reach, or '
                'marked by a covariance below 0) and are not used: check its driver')

    def take(self, T_camera_imu: np.ndarray) -> ImuSamples:
        """
        Return all samples that wait, in the axes of the camera, and forget them.

        :param T_camera_imu: pose of the IMU in the optical frame of the colour camera, 4x4.
        """
        with self._lock:
            stamps, rows = list(self._stamps), list(self._rows)
            self._stamps.clear()
            self._rows.clear()
        values = np.array(rows, np.float64).reshape(-1, 6)
        return ImuSamples(np.array(stamps, np.int64), values[:, :3],
                          values[:, 3:]).in_camera(T_camera_imu)


def _is_within(vector: Sequence[float], limit: float) -> bool:
    """Return whether no component is beyond a limit; NaN is, too."""
    return all(abs(value) <= limit for value in vector)
