# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tables of ``aick evaluate``."""

from __future__ import annotations

from collections.abc import Iterator

from aick_ros.borders.names import counted
from aick_ros.cli.output.console import decimal, table
from aick_ros.evaluation.scores.consistency import DOF, Consistency
from aick_ros.evaluation.scores.evaluation import Evaluation
from aick_ros.evaluation.scores.motion_consistency import MotionConsistency
from aick_ros.evaluation.scores.pair_evaluation import PairScore
from aick_ros.evaluation.scores.rest import RestScore
from aick_ros.evaluation.scores.run_errors import SilentFailures
from aick_ros.evaluation.scores.trajectory_score import TrajectoryScore


def show(evaluation: Evaluation, on_stderr: bool) -> None:
    """Print the tables of an evaluation; gaps without a pair have no row."""
    thresholds = next(iter(evaluation.pairs.values())).success_ratio
    pairs = {gap: score for gap, score in evaluation.pairs.items() if score.count}
    columns = ('gap', 'pairs', 'failed', *(f'within\n{1e3 * float(t):g} mm' for t in thresholds),
               'median\n[mm]', 'median\n[deg]', 'p50\n[ms]', 'p99\n[ms]')
    table(f'{evaluation.source}: {counted(evaluation.frames, "frame")}',
          (_row(gap, score) for gap, score in pairs.items()), columns, on_stderr)
    rows = [_consistency_row('odometry', evaluation.consistency),
            *(_consistency_row(f'gap {gap}', score.consistency) for gap, score in pairs.items())]
    table('covariances', rows,
          ('', f'mean NEES\n(correct: {DOF})', 'inside\n95 %', 'inside\n99.7 %'), on_stderr)
    _show_motions(evaluation, on_stderr)
    score, times = evaluation.trajectory, evaluation.timing_ms
    table('', [
        *error_rows(score, evaluation.frames),
        *_rest(evaluation.rest),
        ('tracked', decimal(score.tracked_fraction)),
        *_silent_failures(evaluation.silent_failures),
        ('keypoints per frame', decimal(evaluation.keypoints_mean, digits=0)),
        *((f'{stage}, p50 / p99', f'{decimal(time.p50, digits=1)} / '
           f'{decimal(time.p99, " ms", 1)}') for stage, time in times.items())],
        on_stderr=on_stderr)


def error_rows(score: TrajectoryScore, frames: int) -> Iterator[tuple[str, str]]:
    """
    Yield the rows of RPE and ATE.

    A row before them says of how many frames they are, where these are not all.

    :param frames: number of all frames.
    """
    if score.covered_frames is not None and score.covered_frames < frames:
        yield 'frames with ground truth', f'{score.covered_frames} of {frames}'
    yield 'RPE over 1 s, translation', decimal(score.rpe_1s_translation_rmse_m, ' m', 4)
    yield 'RPE over 1 s, rotation', decimal(score.rpe_1s_rotation_rmse_deg, ' deg', 2)
    yield 'ATE', decimal(score.ate_rmse_m, ' m', 4)


def _show_motions(evaluation: Evaluation, on_stderr: bool) -> None:
    """Print the consistency along the trajectory; nothing without ground truth."""
    scores = {**{counted(gap, 'frame'): score for gap, score in
                 evaluation.trajectory_consistency.items()}, 'poses': evaluation.pose_consistency}
    rows = [_motion_row(name, score) for name, score in scores.items() if score.count]
    parts = ('all six', 'translation', 'rotation')
    if rows:
        table('covariances along the trajectory', rows,
              ('', 'count', *(head for part, dof in zip(parts, (DOF, 3, 3)) for head in (
                  f'{part}:\nNEES ({dof})', 'inside\n95 %'))), on_stderr)


def _motion_row(name: str, score: MotionConsistency) -> tuple[str, ...]:
    return (name, str(score.count), *(
        cell for part in (score.joint, score.translation, score.rotation)
        for cell in (decimal(part.nees_mean, digits=1), decimal(part.inside_95))))


def _rest(score: RestScore) -> Iterator[tuple[str, str]]:
    """Yield the rows of the drift at rest; none if the camera never rests."""
    if score.stretches:
        yield (f'at rest for {score.duration_s:.0f} s, largest drift',
               f'{decimal(score.largest_translation_m, " m", 4)}, '
               f'{decimal(score.largest_rotation_deg, " deg", 3)}')
        yield ('drift at rest',
               f'{decimal(score.translation_mm_per_min, " mm/min", 1)}, '
               f'{decimal(score.rotation_deg_per_min, " deg/min", 3)}')


def _row(gap: int, score: PairScore) -> tuple[str, ...]:
    median = score.translation_median_m
    return (str(gap), str(score.count), str(score.failed),
            *(decimal(ratio) for ratio in score.success_ratio.values()),
            decimal(None if median is None else 1e3 * median, digits=1),
            decimal(score.rotation_median_deg, digits=2),
            decimal(score.registration_ms.p50, digits=1),
            decimal(score.registration_ms.p99, digits=1))


def _consistency_row(name: str, score: Consistency) -> tuple[str, ...]:
    return (name, decimal(score.nees_mean, digits=1), decimal(score.inside_95),
            decimal(score.inside_997))


def _silent_failures(score: SilentFailures) -> Iterator[tuple[str, str]]:
    """Yield the rows of wrong decisions about increments; none without ground truth."""
    if score.reported_good is not None:
        yield ('accepted, but error above 5 cm or 3 deg',
               f'{score.reported_good_but_off} of {score.reported_good}')
        yield 'rejected, but within both', f'{score.refused_but_good} of {score.refused}'
