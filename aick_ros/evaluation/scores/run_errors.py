# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The increments of a run, believed and refused, against the ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.evaluation.scores.pairs import MAX_HOLE
from aick_ros.geometry import se3
from aick_ros.geometry.pose import Increment
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory


@dataclass(frozen=True)
class RunErrors:
    """
    The errors of the increments that the ground truth can judge.

    :param believed: of the tracked frames.
    :param refused: of the frames whose registration was found but not believed.
    """

    believed: Sequence[IncrementError]
    refused: Sequence[IncrementError]

    @classmethod
    def of(cls, records: Sequence[FrameRecord], ground_truth: Trajectory) -> RunErrors:
        """Return the errors of a run."""
        believed = (_error(record.stamp, record.increment, ground_truth) for record in records)
        refused = (_error(record.stamp, record.rejected, ground_truth) for record in records)
        return cls([error for error in believed if error is not None],
                   [error for error in refused if error is not None])


@dataclass(frozen=True)
class SilentFailures:
    """
    How often a run did not know whether it was right; None without ground truth.

    :param reported_good: increments of tracked frames.
    :param reported_good_but_off: of these, by more than 5 cm or 3 degrees.
    :param refused: registrations that were found but not believed, one a lost frame at most.
    :param refused_but_good: of these, within 5 cm and 3 degrees.
    """

    reported_good: int | None
    reported_good_but_off: int | None
    refused: int | None
    refused_but_good: int | None

    @classmethod
    def of(cls, errors: RunErrors | None) -> SilentFailures:
        """Return the figures of a run."""
        if errors is None:
            return cls(None, None, None, None)
        return cls(len(errors.believed), sum(error.is_wrong for error in errors.believed),
                   len(errors.refused), sum(not error.is_wrong for error in errors.refused))


def _error(stamp: int, increment: Increment | None,
           ground_truth: Trajectory) -> IncrementError | None:
    """Return the error of an increment, None where there is none or no truth to judge it by."""
    if increment is None:
        return None
    T_world_target = ground_truth.at(stamp - round(increment.interval * NANOSECONDS), MAX_HOLE)
    T_world_source = ground_truth.at(stamp, MAX_HOLE)
    if T_world_target is None or T_world_source is None:
        return None
    return IncrementError.of(increment.pose.matrix, increment.pose.covariance,
                             se3.inverse(T_world_target) @ T_world_source)
