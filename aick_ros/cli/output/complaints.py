# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The sentences about sensors of a recording that are not used, as they contradict the camera."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TypeVar

from aick_ros.cli.output.console import say
from aick_ros.odometry import Odometry
from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope

_Update = TypeVar('_Update')


def saying_complaints(recording: str, odometry: Odometry,
                      updates: Iterable[_Update]) -> Iterator[_Update]:
    """
    Yield updates, and say once of each sensor what is wrong with it.

    :param recording: its name.
    :param updates: of the odometry, made as they are asked for.
    """
    sensors: list[Gyroscope | Gravity] = [odometry.gyroscope, odometry.gravity]
    for update in updates:
        for sensor in [sensor for sensor in sensors if sensor.complaint]:
            say(f'{recording}: {sensor.complaint}')
            sensors.remove(sensor)
        yield update
