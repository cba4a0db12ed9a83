# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Samples of an inertial measurement unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from aick_ros.borders.records import replaced
from aick_ros.borders.values import numbers, required_array, whole_number

UNITS = {'gyroscope': 'rad/s', 'accelerometer': 'm/s^2'}
"""Unit of the values of each sensor."""


@dataclass(frozen=True, eq=False)
class ImuSamples:
    """
    Samples of an IMU, in the axes of the optical frame of the colour camera.

    :param stamps: N int64 [ns], in any order: whoever uses them decides what is out of order.
    :param turn_rates: Nx3 float64, by the gyroscope [rad/s]; NaN where it has not measured.
    :param accelerations: Nx3 float64, specific force by the accelerometer: at rest it points up
        and has the length of gravity [m/s^2]; NaN where it has not measured.
    :param position: of the IMU in the camera, 3 float64 [m]; zero: at the camera, as far as it is
        known.
    :raises InputError: where the arrays do not fit each other.
    """

    stamps: np.ndarray
    turn_rates: np.ndarray
    accelerations: np.ndarray
    position: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        """Reject arrays of wrong type or shape."""
        required_array(self.stamps, np.int64, (None,), 'the stamps of an IMU')
        for name, values in (('turn rates', self.turn_rates),
                             ('accelerations', self.accelerations)):
            required_array(values, np.float64, (len(self.stamps), 3), f'the {name} of an IMU')
        required_array(self.position, np.float64, (3,), 'the position of an IMU')

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.stamps)

    def __getitem__(self, chosen: slice | np.ndarray) -> ImuSamples:
        """Return some of the samples, by a slice, their indices or a mask."""
        return ImuSamples(self.stamps[chosen], self.turn_rates[chosen],
                          self.accelerations[chosen], self.position)

    def until(self, stamp: int, after: int | None = None) -> ImuSamples:
        """
        Return the samples up to a stamp [ns] and after another one, of samples in order.

        :raises InputError: where a stamp is no whole number.
        """
        start = 0 if after is None else self._place(after)
        return self[start:self._place(stamp)]

    def in_camera(self, T_camera_imu: np.ndarray) -> ImuSamples:
        """
        Return samples in the axes of an IMU in those of the camera, 4x4.

        :raises InputError: where that is no 4x4 matrix.
        """
        T_camera_imu = numbers(T_camera_imu, (4, 4), 'the pose of an IMU')
        axes = T_camera_imu[:3, :3].T
        return ImuSamples(self.stamps, self.turn_rates @ axes, self.accelerations @ axes,
                          T_camera_imu[:3, 3].copy())

    def _place(self, stamp: int) -> int:
        """Return the number of samples up to a stamp [ns]."""
        return int(np.searchsorted(self.stamps, whole_number(stamp, 'the stamp'), 'right'))


def joined(parts: Sequence[ImuSamples]) -> ImuSamples:
    """Return samples one after the other, of an IMU where the last part says that it is."""
    samples = ImuSamples(
        np.concatenate([np.empty(0, np.int64), *(part.stamps for part in parts)]),
        np.concatenate([np.empty((0, 3)), *(part.turn_rates for part in parts)]),
        np.concatenate([np.empty((0, 3)), *(part.accelerations for part in parts)]))
    return replaced(samples, position=parts[-1].position) if parts else samples
