# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick evaluate``: accuracy of the odometry on a recording with ground truth."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.output.consistency_plots import write_plots
from aick_ros.cli.output.console import decimal, progress, say, table
from aick_ros.cli.output.files import STANDARD_OUTPUT, check_target, write_json
from aick_ros.cli.output.plot_folder import make_plot_folder
from aick_ros.evaluation.scores.consistency import DOF, Consistency
from aick_ros.evaluation.scores.evaluation import Evaluation
from aick_ros.evaluation.scores.evaluation import evaluate as evaluate_source
from aick_ros.evaluation.scores.pair_evaluation import PairScore
from aick_ros.evaluation.scores.run_errors import SilentFailures
from aick_ros.sources import SourceOptions, open_source

Plots = Annotated[Path | None, typer.Option(
    '--plots', metavar='DIR', show_default=False,
    help='Folder for plots of the consistency of the covariances (NEES): one PNG for the '
         'odometry and one per gap.')]


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
    Compare with ground truth: success ratios of pairs, RPE over 1 s, ATE, consistency, times.

    Ctrl-C ends the run with the results up to this point.
    """
    settings = options.settings_from(preset, config, assignments)
    check_target(json)
    numbers = options.gaps_from(gaps)
    recording = open_source(source, SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval,
        register_depth, depth_info_topic, depth_in_colour))
    if recording.ground_truth is None:
        say(f'{recording.name} has no ground truth: only times are measured, no errors')
    elif plots is not None:
        make_plot_folder(plots)
    with Reading(recording, limit) as reading, progress(reading.name, len(reading)) as show:
        evaluation = evaluate_source(reading, settings, numbers, show, reading.damage)
    if json is not None:
        write_json(json, {**evaluation.to_json(), 'ended': reading.ended,
                          'damaged_images': reading.damage.count})
    _show(evaluation, on_stderr=json == STANDARD_OUTPUT)
    if plots is not None:
        write_plots(plots, evaluation)
    if recording.ground_truth is not None and evaluation.trajectory.ate_rmse_m is None:
        say(f'the ground truth of {recording.name} covers none of its frames: check that both '
            'have the same clock')
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
          ('', f'mean NEES\n(correct: {DOF})', 'inside\n95 %', 'inside\n99.7 %'), on_stderr)
    score, times = evaluation.trajectory, evaluation.timing_ms
    table('', [
        ('RPE over 1 s, translation', decimal(score.rpe_1s_translation_rmse_m, ' m', 4)),
        ('RPE over 1 s, rotation', decimal(score.rpe_1s_rotation_rmse_deg, ' deg', 2)),
        ('ATE', decimal(score.ate_rmse_m, ' m', 4)),
        ('tracked', decimal(score.tracked_fraction)),
        *_silent_failures(evaluation.silent_failures),
        ('keypoints per frame', decimal(evaluation.keypoints_mean, digits=0)),
        *((f'{stage}, p50 / p99', f'{decimal(time.p50, digits=1)} / '
           f'{decimal(time.p99, " ms", 1)}') for stage, time in times.items())],
        on_stderr=on_stderr)


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
