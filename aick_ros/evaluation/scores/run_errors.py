# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Errors of the increments of a run, accepted and rejected, against the ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.ground_truth import true_motion
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.geometry.pose import Increment
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.geometry.trajectory import Trajectory


@dataclass(frozen=True)
class RunErrors:
    """
    Errors of the increments of a run that the ground truth covers.

    :param accepted: of the tracked frames.
    :param rejected: of the lost frames that were registered, but whose motion failed a check.
    """

    accepted: Sequence[IncrementError]
    rejected: Sequence[IncrementError]

    @classmethod
    def of(cls, records: Sequence[FrameRecord], ground_truth: Trajectory) -> RunErrors:
        """Return the errors of a run."""
        accepted = (increment_error(record.stamp, record.increment, ground_truth)
                    for record in records)
        rejected = (increment_error(record.stamp, record.rejected, ground_truth)
                    for record in records)
        return cls([error for error in accepted if error is not None],
                   [error for error in rejected if error is not None])


@dataclass(frozen=True)
class SilentFailures:
    """
    Wrong decisions about increments; None without ground truth. The fields are keys of the JSON.

    :param reported_good: number of accepted increments.
    :param reported_good_but_off: of these, with an error above 5 cm or 3 degrees.
    :param refused: number of rejected increments, at most one per lost frame.
    :param refused_but_good: of these, with an error within 5 cm and 3 degrees.
    """

    reported_good: int | None
    reported_good_but_off: int | None
    refused: int | None
    refused_but_good: int | None

    @classmethod
    def of(cls, errors: RunErrors | None) -> SilentFailures:
        """Return the counts of a run."""
        if errors is None:
            return cls(None, None, None, None)
        return cls(len(errors.accepted), sum(error.is_wrong for error in errors.accepted),
                   len(errors.rejected), sum(not error.is_wrong for error in errors.rejected))


def increment_error(stamp: int, increment: Increment | None,
                    ground_truth: Trajectory) -> IncrementError | None:
    """Return the error of an increment; None without an increment or its ground truth."""
    if increment is None:
        return None
    start = stamp - round(increment.interval * NANOSECONDS)
    true_increment = true_motion(ground_truth, start, stamp)
    if true_increment is None:
        return None
    return IncrementError.of(increment.pose.matrix, increment.pose.covariance, true_increment)
