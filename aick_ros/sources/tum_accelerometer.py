# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``accelerometer.txt`` of a TUM folder: the accelerometer of the Kinect."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from aick_ros.borders.files import read_text
from aick_ros.borders.limits import MAX_ACCELERATION, MAX_LIST_BYTES
from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry.trajectory import seconds_to_stamp

FILE = 'accelerometer.txt'

_IN_OPTICAL_FRAME = np.array([-1.0, -1.0, 1.0])
"""Signs of the axes of the sensor; measured on two excerpts, against motion capture."""


def read_accelerations(folder: Path) -> ImuSamples | None:
    """
    Return the samples of a folder in the axes of the camera; None where there are none.

    :raises InputError: where a line is not a stamp and three numbers.
    """
    path = folder / FILE
    if not os.path.lexists(path):
        return None
    samples: dict[int, list[float]] = {}
    for number, line in enumerate(read_text(path, 'the list', MAX_LIST_BYTES).splitlines(), 1):
        if line.strip() and not line.lstrip().startswith('#'):
            stamp, acceleration = _read_line(line, f'{path}, line {number}')
            samples.setdefault(stamp, acceleration)
    stamps = np.array(sorted(samples), np.int64)
    accelerations = np.array([samples[stamp] for stamp in stamps.tolist()]).reshape(-1, 3)
    return ImuSamples(stamps, np.full(accelerations.shape, np.nan),
                      accelerations * _IN_OPTICAL_FRAME)


def _read_line(line: str, where: str) -> tuple[int, list[float]]:
    """Return stamp [ns] and acceleration, 3 [m/s^2], of a line."""
    stamp, *values = line.split()
    try:
        acceleration = [float(value) for value in values]
        if len(acceleration) != 3 or not all(
                abs(value) <= MAX_ACCELERATION for value in acceleration):
            raise ValueError
        return seconds_to_stamp(stamp), acceleration
    except ValueError:
        raise InputError(f'{where}: {line.strip()[:80]!r} is not an acceleration: required are a '
                         'stamp [s] and three numbers [m/s^2]') from None
