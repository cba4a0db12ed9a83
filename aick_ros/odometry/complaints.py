# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Sensors of a recording that are not used, and why, while the odometry runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.odometry import Odometry

_Update = TypeVar('_Update')


def reporting_complaints(odometry: Odometry, updates: Iterable[_Update],
                         on_complaint: Callable[[str], None]) -> Iterator[_Update]:
    """
    Yield updates, and report once of each sensor why it is not used.

    :param updates: of the odometry, made as they are asked for.
    :param on_complaint: called with the sentence, before the update that shows it is yielded.
    """
    sensors: list[Gyroscope | Gravity] = [odometry.gyroscope, odometry.gravity]
    for update in updates:
        for sensor in [sensor for sensor in sensors if sensor.complaint]:
            on_complaint(sensor.complaint)
            sensors.remove(sensor)
        yield update
