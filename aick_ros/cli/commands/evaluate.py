# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick evaluate``: a recording with ground truth, turned into figures."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.output.consistency_plots import check_plots, write_plots
from aick_ros.cli.output.console import figure, progress, say, table
from aick_ros.cli.output.files import STANDARD_OUTPUT, check_target, write_json
from aick_ros.evaluation.scores.consistency import DOF, Consistency
from aick_ros.evaluation.scores.evaluation import Evaluation
from aick_ros.evaluation.scores.evaluation import evaluate as evaluate_source
from aick_ros.evaluation.scores.pair_evaluation import PairScore
from aick_ros.evaluation.scores.run_errors import SilentFailures
from aick_ros.sources import SourceOptions, open_source

Plots = Annotated[Path | None, typer.Option(
    '--plots', metavar='DIR', show_default=False,
    help='Draw how well the covariances foretell the errors: one PNG for the odometry and one a '
         'gap.')]


def evaluate(source: options.Source, gaps: options.Gaps = '1,5,10', json: options.JsonFile = None,
             plots: Plots = None, preset: options.Preset = None, config: options.Config = None,
             assignments: options.Assignments = None, camera: options.CameraFile = None,
             colour_topic: options.ColourTopic = None, depth_topic: options.DepthTopic = None,
             info_topic: options.InfoTopic = None,
             ground_truth_topic: options.GroundTruthTopic = None,
             max_interval: options.MaxInterval = SourceOptions.max_interval,
             register_depth: options.RegisterDepth = False,
             depth_info_topic: options.DepthInfoTopic = None,
             depth_in_colour: options.DepthInColour = None,
             limit: options.Limit = None) -> int:
    """
    Compare with ground truth: success ratios pair by pair, RPE over 1 s, ATE, covariances, times.

    Ctrl-C ends it with the figures up to there.
    """
    settings = options.settings_from(preset, config, assignments)
    if plots is not None:
        check_plots(plots)
    if json is not None:
        check_target(json)
    numbers = options.gaps_from(gaps)
    recording = open_source(source, SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval,
        register_depth, depth_info_topic, depth_in_colour))
    if recording.ground_truth is None:
        say(f'{recording.name} has no ground truth: there are times, but no errors')
    with Reading(recording, limit) as reading, progress(reading.name, len(reading)) as show:
        evaluation = evaluate_source(reading, settings, numbers, show, reading.damage)
    if json is not None:
        write_json(json, {**evaluation.to_json(), 'ended': reading.ended,
                          'damaged_images': reading.damage.count})
    _show(evaluation, on_stderr=json == STANDARD_OUTPUT)
    if plots is not None:
        write_plots(plots, evaluation)
    if recording.ground_truth is not None and evaluation.trajectory.ate_rmse_m is None:
        say(f'the ground truth of {recording.name} covers none of its frames: are both by the '
            'same clock?')
    return outcome.of_reading(reading)


def _show(evaluation: Evaluation, on_stderr: bool) -> None:
    thresholds = next(iter(evaluation.pairs.values())).success_ratio
    columns = ('gap', 'pairs', 'failed', *(f'within\n{1e3 * float(t):g} mm' for t in thresholds),
               'median\n[mm]', 'median\n[deg]', 'p50\n[ms]', 'p99\n[ms]')
    table(f'{evaluation.source}: {evaluation.frames} frames',
          (_row(gap, score) for gap, score in evaluation.pairs.items()), columns, on_stderr)
    rows = [_consistency_row('odometry', evaluation.consistency),
            *(_consistency_row(f'gap {gap}', score.consistency)
              for gap, score in evaluation.pairs.items())]
    table('covariances', rows,
          ('', f'mean NEES\n(right: {DOF})', 'inside\n95 %', 'inside\n99.7 %'), on_stderr)
    score, times = evaluation.trajectory, evaluation.timing_ms
    table('', [
        ('RPE over 1 s, translation', figure(score.rpe_1s_translation_rmse_m, ' m', 4)),
        ('RPE over 1 s, rotation', figure(score.rpe_1s_rotation_rmse_deg, ' deg', 2)),
        ('ATE', figure(score.ate_rmse_m, ' m', 4)),
        ('tracked', figure(score.tracked_fraction)),
        *_silent_failures(evaluation.silent_failures),
        ('keypoints a frame', figure(evaluation.keypoints_mean, digits=0)),
        *((f'{stage}, p50 / p99', f'{figure(time.p50, digits=1)} / '
           f'{figure(time.p99, " ms", 1)}') for stage, time in times.items())],
        on_stderr=on_stderr)


def _row(gap: int, score: PairScore) -> tuple[str, ...]:
    median = score.translation_median_m
    return (str(gap), str(score.count), str(score.failed),
            *(figure(ratio) for ratio in score.success_ratio.values()),
            figure(None if median is None else 1e3 * median, digits=1),
            figure(score.rotation_median_deg, digits=2),
            figure(score.registration_ms.p50, digits=1),
            figure(score.registration_ms.p99, digits=1))


def _consistency_row(name: str, score: Consistency) -> tuple[str, ...]:
    return (name, figure(score.nees_mean, digits=1), figure(score.inside_95),
            figure(score.inside_997))


def _silent_failures(score: SilentFailures) -> Iterator[tuple[str, str]]:
    """Yield the rows of increments that were not judged right; none without ground truth."""
    if score.reported_good is not None:
        yield ('reported good, but off by more than 5 cm or 3 deg',
               f'{score.reported_good_but_off} of {score.reported_good}')
        yield 'refused, but good', f'{score.refused_but_good} of {score.refused}'
