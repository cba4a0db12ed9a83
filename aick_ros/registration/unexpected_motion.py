# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Distance of a motion from the one expected."""

from __future__ import annotations

import math

import numpy as np

from aick_ros.geometry import se3
from aick_ros.registration.expected_pose import ExpectedPose
from aick_ros.settings import OdometrySettings

_SUDDEN = 5.0, 2.0
"""Acceleration and angular acceleration above which a motion is sudden [sigma].

Chosen on rendered rooms with boards that move through 10 to 60 % of the view."""

_WITHIN = 2.0  # chosen: standard deviations of the errors of stamps

NEAR_POSE = 0.05, np.radians(3.0)
"""Distance of two poses that do not contradict each other, though each may be rough [m, rad].
Chosen: poses by AICK alone have a third of it at most in 95 of 100 frames of two excerpts of real
recordings."""

_SAME_POSE = 0.015, np.radians(0.8)  # m and rad; chosen likewise


def sudden_accelerations(settings: OdometrySettings) -> tuple[float, float]:
    """Return the acceleration [m/s^2] and the angular one [rad/s^2] that are sudden."""
    acceleration, angular = _SUDDEN
    return (acceleration * settings.acceleration_sigma,
            angular * settings.angular_acceleration_sigma)


def suddenness(T_target_source: np.ndarray, expected: ExpectedPose,
               limits: tuple[float, float]) -> float:
    """
    Return the apparent acceleration by its limit, the larger of the two ratios.

    :param T_target_source: the pose that is found, 4x4.
    :param limits: acceleration [m/s^2] and angular acceleration [rad/s^2], such that the
        change against the motion expected is at most the limit times the squared time. Errors of
        stamps look like accelerations, and add to that.
    """
    changes = _distances(expected.change_to(T_target_source))
    return max(change / (limit * expected.elapsed ** 2 + _WITHIN * by_stamps)
               for change, limit, by_stamps in zip(changes, limits, expected.timing))


def is_continued(T_target_source: np.ndarray, expected: ExpectedPose,
                 limits: tuple[float, float]) -> bool:
    """Return whether a pose, 4x4, is near the one expected, and the motion to it not sudden."""
    return (is_same(expected.T_target_source, T_target_source, NEAR_POSE)
            and suddenness(T_target_source, expected, limits) <= 1.0)


def is_same(first: np.ndarray, second: np.ndarray,
            tolerance: tuple[float, float] = _SAME_POSE) -> bool:
    """
    Return whether two poses, 4x4, are alike.

    :param tolerance: of the position and of the orientation [m, rad].
    """
    shift, angle = _distances(se3.inverse(first) @ second)
    return bool(shift < tolerance[0] and angle < tolerance[1])


def _distances(change: np.ndarray) -> tuple[float, float]:
    return math.hypot(*change[:3, 3].tolist()), se3.angle(change[:3, :3])
