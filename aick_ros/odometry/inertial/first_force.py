# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The force before a first frame, that shows what is up."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.odometry.inertial.force_integral import ForceIntegral
from aick_ros.odometry.inertial.gravity_filter import GRAVITY

_FIRST = NANOSECONDS // 10  # chosen on two excerpts of real recordings: a hand turns meanwhile
_TURNED, _STEP = 2 * NANOSECONDS, NANOSECONDS // 50
"""Longest time of forces that a gyroscope turns, and that of one turn.

Chosen on rendered rooms: a hand's acceleration tilts the start by a third less with 2 s."""

_HAND = 0.5  # m/s^2; chosen: acceleration of a camera that is held
_PLAUSIBLE = 0.5, 1.5  # chosen: force of a camera at the start, by gravity

RotationBetween = Callable[[int, int], np.ndarray | None]
"""From two stamps of images [ns] to the rotation between them by a gyroscope, 3x3, that takes
directions at the second one to the axes at the first; None where it is not known."""


def first_force(forces: ForceIntegral, turn: RotationBetween, stamp: int,
                offset: int) -> np.ndarray | None:
    """
    Return the mean force before a frame, 3, in its axes [m/s^2]; None: there is none.

    :param stamp: of the frame [ns]; ``offset``: to add to it to get that of the forces [ns].
    """
    recent = forces.recent(stamp + offset, _FIRST)
    if not len(recent):
        return None
    force = _turned_force(forces, turn, stamp, offset)
    if force is None:
        force = recent.mean(axis=0)
    return force


def may_be_gravity(force: np.ndarray) -> bool:
    """Return whether a force, 3 [m/s^2], may be that of a camera which is hardly accelerated."""
    low, high = _PLAUSIBLE
    return bool(low < np.linalg.norm(force) / GRAVITY < high)


def variance(force: np.ndarray) -> float:
    """Return the variance of each component of a force, 3, as that of gravity [m^2/s^4]."""
    return _HAND ** 2 + (float(np.linalg.norm(force)) - GRAVITY) ** 2


def tilt_variance(force: np.ndarray, bias_sigma: float) -> float:
    """
    Return the variance of roll, and of pitch, by a first force [rad^2].

    :param bias_sigma: standard deviation of the bias in it [m/s^2].
    """
    return (variance(force) + bias_sigma ** 2) / GRAVITY ** 2


def _turned_force(forces: ForceIntegral, turn: RotationBetween, stamp: int,
                  offset: int) -> np.ndarray | None:
    """
    Return the mean force of a longer time before a frame, turned by the gyroscope, 3.

    None where there is no gyroscope, or the turned forces differ more than those that are not:
    the camera has not confirmed the gyroscope yet.
    """
    measured, turned = [], []
    for end in range(stamp, stamp - _TURNED, -_STEP):
        rotation = turn(end - _STEP // 2, stamp)
        if rotation is None:
            break
        recent = forces.recent(end + offset, _STEP)
        if len(recent):
            measured.append(recent.mean(axis=0))
            turned.append(rotation.T @ measured[-1])
    if len(turned) * _STEP <= _FIRST or np.var(turned, axis=0).sum() > np.var(
            measured, axis=0).sum():
        return None
    force: np.ndarray = np.mean(turned, axis=0)
    return force
