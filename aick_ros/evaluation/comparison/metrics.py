# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Metrics by which two runs are compared.

Each is a function of the mean of one value per frame, so that a bootstrap over the frames is a
bootstrap of the metric.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from aick_ros.evaluation.runs.run import Run
from aick_ros.evaluation.scores.consistency import QUANTILE_95
from aick_ros.evaluation.scores.frame_record import FrameRecord, trajectory_of
from aick_ros.evaluation.scores.run_errors import increment_error
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors, compare
from aick_ros.geometry.trajectory import Trajectory

Values = Mapping[int, float]
"""Stamp [ns] -> value of that frame."""

_NOMINAL = 0.95  # by definition


@dataclass(frozen=True)
class Metric:
    """
    One number about a run on a recording; smaller is better.

    :param key: of the JSON.
    :param title: for people.
    :param unit: for people.
    :param of_mean: from the mean of the values of the frames to the metric, elementwise.
    :param is_relative: changes are ratios; otherwise they are differences.
    :param tolerance: changes below it are none: a share, or a difference.
    :param depends_on_machine: it says more about the machine than about the odometry, and is
        never a regression.
    """

    key: str
    title: str
    unit: str
    of_mean: Callable[[np.ndarray], np.ndarray]
    is_relative: bool = True
    tolerance: float = 0.01  # chosen
    depends_on_machine: bool = False

    def change(self, baseline: np.ndarray, candidate: np.ndarray) -> np.ndarray:
        """
        Return the changes from some values of the metric to others.

        :returns: logarithms of their ratio, or differences: changes of several recordings can be
            averaged.
        """
        if not self.is_relative:
            changes: np.ndarray = candidate - baseline
            return changes
        smallest = np.finfo(np.float64).tiny  # no error at all on both sides is no change
        ratios: np.ndarray = np.log(np.maximum(candidate, smallest)
                                    / np.maximum(baseline, smallest))
        return ratios

    def as_share(self, change: float) -> float:
        """Return a change as a share: .1 is 10 % more, or ten percentage points."""
        return float(np.expm1(change)) if self.is_relative else change


def _distance_from_nominal(inside: np.ndarray) -> np.ndarray:
    distances: np.ndarray = np.abs(inside - _NOMINAL)
    return distances


RPE_TRANSLATION = Metric('rpe_1s_translation_m', 'RPE over 1 s, translation', 'm', np.sqrt)
RPE_ROTATION = Metric('rpe_1s_rotation_deg', 'RPE over 1 s, rotation', 'deg', np.sqrt)
ATE = Metric('ate_m', 'ATE', 'm', np.sqrt)
COVERAGE = Metric('inside_95_off_nominal', 'increments inside 95 %, distance from .95', '',
                  _distance_from_nominal, is_relative=False)
LOST = Metric('lost', 'frames not tracked', '', np.positive, is_relative=False, tolerance=1e-3)
TIME = Metric('frame_ms', 'time of a frame', 'ms', np.positive, depends_on_machine=True)
MEMORY = Metric('peak_memory_mb', 'peak memory', 'MB', np.positive, depends_on_machine=True)

METRICS = (RPE_TRANSLATION, RPE_ROTATION, ATE, COVERAGE, LOST, TIME, MEMORY)


def values_of(run: Run, ground_truth: Trajectory | None) -> dict[Metric, Values]:
    """
    Return the values of each metric that a run has.

    :param ground_truth: of the recording, if it is known.
    """
    stamps = [record.stamp for record in run.records]
    values: dict[Metric, Values] = {
        LOST: dict(zip(stamps, (float(record.status.is_lost) for record in run.records))),
        TIME: {record.stamp: record.timing['total'] for record in run.records
               if 'total' in record.timing}}
    if run.peak_memory_mb is not None:
        values[MEMORY] = dict.fromkeys(stamps, run.peak_memory_mb)
    if ground_truth is not None:
        errors = compare(trajectory_of(run.records), ground_truth)
        if errors is not None:
            values.update(_errors(errors))
        values[COVERAGE] = dict(_inside(run.records, ground_truth))
    return {metric: values[metric] for metric in METRICS if values.get(metric)}


def _errors(errors: TrajectoryErrors) -> Iterator[tuple[Metric, Values]]:
    """Yield the squared errors of a trajectory; one pose is aligned to any other, without ATE."""
    stamps = errors.estimate.stamps
    first, translations, rotations = errors.relative_from(1.0)
    yield RPE_TRANSLATION, _by_stamp(stamps[first], translations ** 2)
    yield RPE_ROTATION, _by_stamp(stamps[first], np.degrees(rotations) ** 2)
    if len(stamps) > 1:
        yield ATE, _by_stamp(stamps, errors.positions() ** 2)


def _by_stamp(stamps: np.ndarray, values: np.ndarray) -> Values:
    return dict(zip(stamps.tolist(), values.tolist()))


def _inside(records: Sequence[FrameRecord],
            ground_truth: Trajectory) -> Iterator[tuple[int, float]]:
    """Yield the stamps of the increments with a covariance, and whether they are inside 95 %."""
    for record in records:
        error = increment_error(record.stamp, record.increment, ground_truth)
        if error is not None and error.nees is not None:
            yield record.stamp, float(error.nees <= QUANTILE_95)
