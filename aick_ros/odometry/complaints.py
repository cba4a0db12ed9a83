# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Contradictions of sensors and plane to the camera, reported while a recording is followed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from aick_ros.odometry.inertial.gravity import Gravity
from aick_ros.odometry.inertial.gyroscope import Gyroscope
from aick_ros.odometry.odometry import Odometry
from aick_ros.odometry.plane import Plane

_Update = TypeVar('_Update')

_NUMBER = re.compile(r'-?\d[\d.]*(e[+-]?\d+)?|\bnan\b')  # what is measured differs by frame


def reporting_complaints(odometry: Odometry, updates: Iterable[_Update],
                         on_complaint: Callable[[str], None]) -> Iterator[_Update]:
    """
    Yield updates, and report why a sensor is not used, and of the plane: each reason once.

    A reason that differs from an earlier one in its numbers alone is the same.

    :param updates: of the odometry, made as they are asked for.
    :param on_complaint: called with the sentence, before the update that shows it is yielded.
    """
    parts: list[Gyroscope | Gravity | Plane] = [
        odometry.gyroscope, odometry.gravity, odometry.plane]
    reported = {''}
    for update in updates:
        for complaint in [part.complaint for part in parts]:
            reason = _NUMBER.sub('', complaint)
            if reason not in reported:
                on_complaint(complaint)
                reported.add(reason)
        yield update
