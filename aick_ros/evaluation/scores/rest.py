# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Drift of the odometry while the camera rests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors, compare
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

MIN_REST = 1.0  # s; chosen: a camera that turns back in the hand stops for less
MAX_DISTANCE = 0.002  # m; chosen: above the jitter of motion capture
MAX_ANGLE = float(np.radians(0.2))  # chosen likewise


@dataclass(frozen=True)
class RestScore:
    """
    Drift while the ground truth stays within 2 mm and 0.2 degrees for at least a second.

    None where it never does. The fields are keys of the JSON.

    :param stretches: how often the camera rests.
    :param duration_s: how long in all.
    :param largest_translation_m: largest error since the beginning of a rest.
    :param largest_rotation_deg: likewise.
    :param translation_mm_per_min: errors at the ends of the rests by their duration.
    :param rotation_deg_per_min: likewise.
    """

    stretches: int
    duration_s: float
    largest_translation_m: float | None
    largest_rotation_deg: float | None
    translation_mm_per_min: float | None
    rotation_deg_per_min: float | None

    @classmethod
    def of(cls, records: Sequence[FrameRecord], ground_truth: Trajectory | None) -> RestScore:
        """Return the drift of a run."""
        errors = None
        if records and ground_truth is not None:
            errors = compare(trajectory_of(records), ground_truth)
        rests = [] if errors is None else [
            _drift(errors, first, last) for first, last in _rests(errors.truth)]
        if not rests:
            return cls(0, 0.0, None, None, None, None)
        minutes = sum(rest.duration for rest in rests) / 60.0
        distance, angle = (sum(ends) for ends in zip(*((
            rest.distances[-1], rest.angles[-1]) for rest in rests)))
        return cls(len(rests), 60.0 * minutes,
                   max(float(rest.distances.max()) for rest in rests),
                   float(np.degrees(max(rest.angles.max() for rest in rests))),
                   float(1e3 * distance / minutes), float(np.degrees(angle) / minutes))


@dataclass(frozen=True, eq=False)
class _Drift:
    """
    Errors of the poses of a rest, relative to its first one.

    :param duration: [s].
    :param distances: N [m].
    :param angles: N [rad].
    """

    duration: float
    distances: np.ndarray
    angles: np.ndarray


def _rests(truth: Trajectory) -> Iterator[tuple[int, int]]:
    """Yield the first and the last index of each rest."""
    first = 0
    while first < len(truth):
        last = first
        while last + 1 < len(truth) and _is_near(truth.poses[first], truth.poses[last + 1]):
            last += 1
        if truth.stamps[last] - truth.stamps[first] >= MIN_REST * NANOSECONDS:
            yield first, last
            first = last
        first += 1


def _is_near(first: np.ndarray, second: np.ndarray) -> bool:
    error = se3.difference(second, first)
    return bool(np.linalg.norm(error[:3]) <= MAX_DISTANCE
                and np.linalg.norm(error[3:]) <= MAX_ANGLE)


def _drift(errors: TrajectoryErrors, first: int, last: int) -> _Drift:
    T_odom_world = errors.estimate.poses[first] @ se3.inverse(errors.truth.poses[first])
    differences = np.array([
        se3.difference(pose, T_odom_world @ truth)
        for pose, truth in zip(errors.estimate.poses[first:last + 1],
                               errors.truth.poses[first:last + 1])])
    return _Drift(float(errors.truth.stamps[last] - errors.truth.stamps[first]) / NANOSECONDS,
                  np.linalg.norm(differences[:, :3], axis=1),
                  np.linalg.norm(differences[:, 3:], axis=1))
