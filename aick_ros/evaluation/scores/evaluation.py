# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Evaluation of the odometry on a recording with ground truth."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from aick_ros.errors import InputError
from aick_ros.evaluation.scores.consistency import Consistency
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.increment_error import IncrementError
from aick_ros.evaluation.scores.machine import machine_facts
from aick_ros.evaluation.scores.motion_consistency import (
    MotionConsistency, gap_consistency, pose_consistency)
from aick_ros.evaluation.scores.pair_evaluation import PairError, PairEvaluation, PairScore
from aick_ros.evaluation.scores.rest import RestScore
from aick_ros.evaluation.scores.run_errors import RunErrors, SilentFailures
from aick_ros.evaluation.scores.run_summary import stage_times
from aick_ros.evaluation.scores.statistics import Percentiles, mean
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore
from aick_ros.odometry import Odometry
from aick_ros.odometry.complaints import reporting_complaints
from aick_ros.odometry.level_start import begun_level
from aick_ros.settings import Settings
from aick_ros.settings.parameter import values
from aick_ros.sources import OnDamaged, RgbdSource, raise_damage

GAPS = (1, 5, 10)


@dataclass(frozen=True)
class Evaluation:
    """
    Scores on a recording; the fields but ``nees`` and ``records`` are the keys of the JSON.

    :param pairs: gap -> score of all pairs of frames at this distance in the list of frames.
    :param consistency: of the covariances of the odometry's increments.
    :param trajectory_consistency: gap -> that of the motion along the trajectory over it.
    :param pose_consistency: of the covariances accumulated since the start.
    :param rest: drift while the camera rests.
    :param timing_ms: stage of the odometry -> milliseconds per frame.
    :param settings: dotted name -> value.
    :param nees: 'odometry' or the gap as text -> NEES of its increments or pairs.
    :param records: of all frames.
    """

    source: str
    frames: int
    keypoints_mean: float | None
    pairs: dict[int, PairScore]
    trajectory: TrajectoryScore
    consistency: Consistency
    trajectory_consistency: dict[int, MotionConsistency]
    pose_consistency: MotionConsistency
    rest: RestScore
    silent_failures: SilentFailures
    timing_ms: dict[str, Percentiles]
    settings: dict[str, Any]
    machine: dict[str, str | int]
    nees: dict[str, list[float]]
    records: Sequence[FrameRecord]

    def to_json(self) -> dict[str, Any]:
        """Return the content of the JSON; a missing value is None."""
        content = dataclasses.asdict(dataclasses.replace(self, records=()))
        del content['nees'], content['records']
        for key in ('pairs', 'trajectory_consistency'):
            content[key] = {str(gap): score for gap, score in content[key].items()}
        return content


def evaluate(source: RgbdSource, settings: Settings = Settings(), gaps: Sequence[int] = GAPS,
             on_progress: Callable[[int], None] = lambda frames: None,
             on_damaged: OnDamaged = raise_damage,
             on_complaint: Callable[[str], None] = lambda sentence: None) -> Evaluation:
    """
    Run the odometry over a recording, register its pairs, and compare with the ground truth.

    Without ground truth pairs have no error, and none is registered.

    :param gaps: distances of the two frames of a pair in the list of frames.
    :param on_progress: called after each frame with the number of frames done.
    :param on_complaint: called once for each reason why a sensor is not used.
    :raises InputError: where the recording has no usable frame, or a gap is below 1.
    """
    if not gaps or min(gaps) < 1:
        raise InputError(f'gaps {list(gaps)}: at least one gap is required, and each must be 1 '
                         'or more')
    odometry = Odometry(settings)
    pairs = None
    if source.ground_truth is not None:
        pairs = PairEvaluation(settings, source.ground_truth, gaps)

    def records_one_by_one() -> Iterator[FrameRecord]:
        for count, frame in enumerate(source.frames(on_damaged), 1):
            update = odometry.register_frame(frame)
            if pairs is not None:
                pairs.add(update.prepared)
            on_progress(count)
            yield FrameRecord.of(update)

    records = list(begun_level(odometry, settings.imu, reporting_complaints(
        odometry, records_one_by_one(), on_complaint)))
    if not records:
        raise InputError(f'{source.name} has no usable frame')
    return _evaluation(source, settings, records,
                       {gap: [] for gap in gaps} if pairs is None else pairs.errors())


def _evaluation(source: RgbdSource, settings: Settings, records: Sequence[FrameRecord],
                pair_errors: Mapping[int, Sequence[PairError]]) -> Evaluation:
    run_errors = None
    if source.ground_truth is not None:
        run_errors = RunErrors.of(records, source.ground_truth)
    nees = {'odometry': _nees(run_errors.accepted if run_errors else []),
            **{str(gap): _nees(errors) for gap, errors in pair_errors.items()}}
    return Evaluation(
        source=source.name, frames=len(records),
        keypoints_mean=mean(record.keypoints for record in records),
        pairs={gap: PairScore.of(errors) for gap, errors in pair_errors.items()},
        trajectory=TrajectoryScore.of(records, source.ground_truth),
        consistency=Consistency.of(nees['odometry']),
        trajectory_consistency=gap_consistency(records, source.ground_truth),
        pose_consistency=pose_consistency(records, source.ground_truth),
        rest=RestScore.of(records, source.ground_truth),
        silent_failures=SilentFailures.of(run_errors),
        timing_ms=stage_times(records), settings=values(settings), machine=machine_facts(),
        nees=nees, records=records)


def _nees(errors: Sequence[PairError | IncrementError]) -> list[float]:
    return [error.nees for error in errors if error.nees is not None]
