# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Statistics of one run of the odometry over a recording."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from aick_ros.evaluation.scores.frame_record import FrameRecord, stages_of, trajectory_of
from aick_ros.evaluation.scores.machine import machine_facts, peak_memory_mb
from aick_ros.evaluation.scores.statistics import Percentiles, mean
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values
from aick_ros.sources import RgbdSource


@dataclass(frozen=True)
class RunSummary:
    """
    Statistics of a run; the fields are the keys of the JSON.

    :param ended: ``complete``, or why the run ended before the recording did.
    :param frames: number of frames processed, tracked or lost.
    :param damaged_images: number of images that were skipped.
    :param status: name of the status -> number of frames.
    :param duration_s: duration of the recording.
    :param wall_time_s: duration of the run.
    :param end_distance_m: distance from the first to the last position.
    :param peak_memory_mb: largest resident memory of the process so far.
    :param timing_ms: stage of the odometry -> milliseconds per frame.
    """

    source: str
    ended: str
    frames: int
    damaged_images: int
    tracked: int
    status: dict[str, int]
    duration_s: float
    wall_time_s: float
    frames_per_second: float
    peak_memory_mb: float
    path_length_m: float
    end_distance_m: float
    keypoints_mean: float | None
    matches_mean: float | None
    trajectory: TrajectoryScore
    timing_ms: dict[str, Percentiles]
    settings: dict[str, Any]
    machine: dict[str, str | int]

    def to_json(self) -> dict[str, Any]:
        """Return the content of the JSON; a missing value is None."""
        return dataclasses.asdict(self)


def summarize(source: RgbdSource, records: Sequence[FrameRecord], settings: Settings,
              wall_time: float, ended: str = 'complete', damaged_images: int = 0) -> RunSummary:
    """
    Return the statistics of a run.

    :param records: of all frames, at least one.
    :param wall_time: duration of the run [s].
    """
    positions = trajectory_of(records).poses[:, :3, 3]
    return RunSummary(
        source=source.name, ended=ended, frames=len(records), damaged_images=damaged_images,
        tracked=sum(record.status.ok for record in records),
        status=dict(Counter(record.status.name for record in records)),
        duration_s=(records[-1].stamp - records[0].stamp) / NANOSECONDS,
        wall_time_s=wall_time, frames_per_second=len(records) / wall_time,
        peak_memory_mb=peak_memory_mb(),
        path_length_m=float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()),
        end_distance_m=float(np.linalg.norm(positions[-1] - positions[0])),
        keypoints_mean=mean(record.keypoints for record in records),
        matches_mean=mean(record.matches for record in records if record.increment is not None),
        trajectory=TrajectoryScore.of(records, source.ground_truth),
        timing_ms=stage_times(records), settings=values(settings), machine=machine_facts())


def stage_times(records: Sequence[FrameRecord]) -> dict[str, Percentiles]:
    """Return the milliseconds per frame of each stage."""
    return {stage: Percentiles.of(record.timing[stage] for record in records
                                  if stage in record.timing)
            for stage in stages_of(records)}
