# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Check of an IMU that was recorded at rest, by its own values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.imu import UNITS

_SPAN = 1.0  # s; chosen: over which values are averaged
_OUTLIER = 10.0  # by the median of the changes; chosen: noise never exceeds it


@dataclass(frozen=True)
class _Limits:
    """
    What values of a sensor at rest do not exceed.

    :param change: median change of the mean over a second to the next.
    :param step: change that resolution and temperature may cause.
    :param value: bias.
    """

    change: float
    step: float
    value: float


_LIMITS = {
    # chosen: a hand turns by some tenths of rad/s, and the data sheets allow biases of 0.05 rad/s
    'gyroscope': _Limits(0.005, 0.0005, 0.2),
    # chosen: a tilt by half a degree; gravity with a bias of a fifth
    'accelerometer': _Limits(0.1, 0.005, 12.0),
}


def check_rest(source: str, name: str, values: np.ndarray, interval: float) -> None:
    """
    Check that a sensor was at rest.

    :param source: name of the recording.
    :param name: ``gyroscope`` or ``accelerometer``.
    :param values: Nx3, at least two seconds of them.
    :param interval: between them [s].
    :raises InputError: where it has moved, with time and change.
    """
    limits, count = _LIMITS[name], max(round(_SPAN / interval), 1)
    means = values[:len(values) // count * count].reshape(-1, count, 3).mean(axis=1)
    changes = np.linalg.norm(np.diff(means, axis=0), axis=1)
    typical, size = float(np.median(changes)), float(np.linalg.norm(values.mean(axis=0)))
    largest = int(np.argmax(changes))
    if typical > limits.change:
        moves = f'its mean changes by {typical:.3g} {UNITS[name]} from one second to the next'
    elif size > limits.value:
        moves = f'its mean is {size:.3g} {UNITS[name]}'
    elif changes[largest] > max(_OUTLIER * typical, limits.step):
        moves = (f'its mean changes by {changes[largest]:.3g} {UNITS[name]} '
                 f'{(largest + 1) * count * interval:.0f} s after the start')
    else:
        return
    raise InputError(f'{source}: the {name} is not at rest, {moves}: record the IMU on a firm '
                     'surface that nothing shakes')
