# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Accuracy of the trajectory of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.statistics import mean, root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors, compare
from aick_ros.geometry.trajectory import Trajectory


@dataclass(frozen=True)
class TrajectoryScore:
    """
    Errors of a trajectory; None without ground truth.

    :param rpe_1s_translation_rmse_m: RMSE of the translation over 1 s, of all pairs of poses.
    :param rpe_1s_rotation_rmse_deg: RMSE of the rotation over 1 s, of all pairs of poses.
    :param ate_rmse_m: RMSE of the positions after rigid alignment, of two poses and more.
    :param tracked_fraction: share of tracked frames; the held poses of lost frames count in the
        errors.
    :param covered_frames: number of frames that the ground truth covers; ATE and RPE are of these.
    """

    rpe_1s_translation_rmse_m: float | None
    rpe_1s_rotation_rmse_deg: float | None
    ate_rmse_m: float | None
    tracked_fraction: float | None
    covered_frames: int | None = None

    @classmethod
    def of(cls, records: Sequence[FrameRecord],
           ground_truth: Trajectory | None) -> TrajectoryScore:
        """Return the score of a run."""
        errors = None
        if records and ground_truth is not None:
            errors = compare(trajectory_of(records), ground_truth)
        covered = 0 if errors is None else len(errors.estimate)
        return cls(*_errors(errors), mean(record.status.ok for record in records),
                   None if ground_truth is None else covered)


def _errors(errors: TrajectoryErrors | None) -> tuple[float | None, float | None, float | None]:
    if errors is None:
        return None, None, None
    translations, rotations = errors.relative(1.0)
    positions = errors.positions()
    return (root_mean_square(translations), root_mean_square(np.degrees(rotations)),
            root_mean_square(positions) if len(positions) > 1 else None)
