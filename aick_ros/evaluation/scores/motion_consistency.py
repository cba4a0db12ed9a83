# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Consistency of the covariances along a trajectory: of its poses, and of its motions over a gap.

Two poses of a trajectory share most of their errors, so the covariance of the motion between them
does not follow from their own covariances. What follows from a run is the motion as a consumer
adds it up: the increments from frame to frame composed, and their covariances propagated as if
their errors were independent. Increments to one keyframe are not: half of the error of one returns
with the opposite sign in the next. So the covariance over a gap is too large rather than too small
(measured on two excerpts of real recordings: the median of its NEES at gap 10 is half of that
with the registrations to the keyframes themselves). Corrections by keyframes that are found again
are in the poses, not in the increments.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.consistency import Consistency, nees
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.ground_truth import true_motion, true_pose
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment, PoseWithCovariance
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory

TRAJECTORY_GAPS = (1, 10, 30, 100)  # by definition
"""Distances in frames over which the motion along a trajectory is scored."""


@dataclass(frozen=True)
class MotionConsistency:
    """
    Consistency of some poses or motions, of all six errors and of both parts apart.

    The values along one trajectory are correlated: they are one sample of its drift rather than
    many. The fields are keys of the JSON.
    """

    count: int
    joint: Consistency
    translation: Consistency
    rotation: Consistency

    @classmethod
    def of(cls, estimates: Iterable[tuple[PoseWithCovariance, np.ndarray]]) -> MotionConsistency:
        """
        Return the consistency of estimates, each with the truth.

        An estimate with an infinite covariance counts, but has no NEES.
        """
        errors = [(se3.difference(pose.matrix, truth), pose.covariance)
                  for pose, truth in estimates]
        parts = ((slice(0, 6), 6), (slice(0, 3), 3), (slice(3, 6), 3))
        return cls(len(errors), *(
            Consistency.of((nees(error[part], covariance[part, part])
                            for error, covariance in errors), dof) for part, dof in parts))


def gap_consistency(records: Sequence[FrameRecord], ground_truth: Trajectory | None,
                    gaps: Sequence[int] = TRAJECTORY_GAPS) -> dict[int, MotionConsistency]:
    """
    Return gap -> consistency of the motions over so many frames.

    A motion counts if the ground truth covers it and all its increments were measured: there is
    none across a lost frame that was bridged from an earlier one.
    """
    paths, stamps = _paths(records), [record.stamp for record in records]
    return {gap: MotionConsistency.of(() if ground_truth is None else _motions(
        paths, zip(stamps, stamps[gap:]), ground_truth)) for gap in gaps}


def pose_consistency(records: Sequence[FrameRecord],
                     ground_truth: Trajectory | None) -> MotionConsistency:
    """Return the consistency of the poses, with their covariance accumulated since the start."""
    references = [] if ground_truth is None else reference_poses(records, ground_truth)
    return MotionConsistency.of((record.pose, truth) for record, truth in references[1:]
                                if record.pose.covariance.any())


def reference_poses(records: Sequence[FrameRecord],
                    ground_truth: Trajectory) -> list[tuple[FrameRecord, np.ndarray]]:
    """
    Return the records that the ground truth covers, each with its true ``T_odom_camera``.

    The ground truth is moved to the first of them, whose pose is exact by definition.
    """
    covered = [(record, truth) for record in records
               if (truth := true_pose(ground_truth, record.stamp)) is not None]
    if not covered:
        return []
    start, T_world_start = covered[0]
    T_odom_world = start.T_odom_camera @ se3.inverse(T_world_start)
    return [(record, T_odom_world @ truth) for record, truth in covered]


@dataclass(frozen=True, eq=False)
class _Path:
    """
    A frame on a path of increments without a gap.

    :param number: of the path.
    :param pose: the increments since its beginning, composed.
    """

    number: int
    pose: PoseWithCovariance


def _paths(records: Sequence[FrameRecord]) -> dict[int, _Path]:
    """Return stamp -> where the frame is, for the frames with a path."""
    paths: dict[int, _Path] = {}
    last, number = 0, 0
    for record in records:
        if not record.status.ok:
            continue
        increment = record.increment
        if increment is not None and _follows(increment, record.stamp, last):
            paths[record.stamp] = _Path(number, paths[last].pose @ increment.pose)
        else:
            number += 1
            paths[record.stamp] = _Path(number, PoseWithCovariance.identity())
        last = record.stamp
    return paths


def _follows(increment: Increment, stamp: int, last: int) -> bool:
    """Return whether an increment begins at the last tracked frame and has a covariance."""
    start = stamp - round(increment.interval * NANOSECONDS)
    return start == last and bool(np.isfinite(increment.pose.covariance).all())


def _motions(paths: Mapping[int, _Path], pairs: Iterable[tuple[int, int]],
             ground_truth: Trajectory) -> Iterator[tuple[PoseWithCovariance, np.ndarray]]:
    """Yield the motions of pairs of stamps that have one, each with the truth."""
    for first, second in pairs:
        start, end = paths.get(first), paths.get(second)
        if start is None or end is None or start.number != end.number:
            continue
        truth = true_motion(ground_truth, first, second)
        if truth is not None:
            yield end.pose.since(start.pose), truth
