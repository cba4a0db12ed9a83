# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Scores of one run of the odometry over frames with ground truth."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.run_errors import RunErrors
from aick_ros.evaluation.scores.statistics import root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors, compare
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry

OF_OBJECTS = 'move by themselves', 'has moved before'
"""Parts of the reason of a frame in which keypoints seem to be on objects that move."""


@dataclass(frozen=True, eq=False)
class RunScores:
    """
    Scores of a run.

    :param frames: number of frames.
    :param lost: number of frames that were lost.
    :param with_objects: number of frames in which keypoints seem to move by themselves.
    :param trajectory: errors of the poses.
    :param nees: of the increments that the ground truth covers; None where one claims nothing.
    """

    frames: int
    lost: int
    with_objects: int
    trajectory: TrajectoryErrors
    nees: Sequence[float | None]

    @classmethod
    def of(cls, frames: Iterable[RgbdFrame], truth: Trajectory) -> RunScores:
        """Return the scores of a new odometry with the defaults."""
        odometry = Odometry()
        records = [FrameRecord.of(odometry.register_frame(frame)) for frame in frames]
        trajectory = compare(trajectory_of(records), truth)
        if trajectory is None:
            raise SystemExit('the ground truth covers none of the frames')
        return cls(len(records), sum(record.status.is_lost for record in records),
                   sum(has_objects(record) for record in records), trajectory,
                   [error.nees for error in RunErrors.of(records, truth).accepted])

    @property
    def ate(self) -> float:
        """Root mean square of the errors of the positions [m]."""
        return root_mean_square(self.trajectory.positions()) or 0.0

    @property
    def consistency(self) -> Consistency:
        """Consistency of the increments with their covariances."""
        return Consistency.of(self.nees)


def has_objects(record: FrameRecord) -> bool:
    """Return whether keypoints of a frame seem to move by themselves, by its reason."""
    return any(part in record.reason for part in OF_OBJECTS)
