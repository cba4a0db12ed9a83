# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick evaluate``: accuracy of the odometry on a recording with ground truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.output.consistency_plots import write_plots
from aick_ros.cli.output.console import progress, say
from aick_ros.cli.output.evaluation_tables import show
from aick_ros.cli.output.files import write_json
from aick_ros.cli.output.ground_truth_limits import say_limits
from aick_ros.cli.output.missing_pairs import without_pairs
from aick_ros.cli.output.plot_folder import make_folder, make_plot_folder, removed_if_empty
from aick_ros.cli.output.square_files import write_square
from aick_ros.cli.output.target import STANDARD_OUTPUT, check_target
from aick_ros.cli.output.untracked import say_if_untracked
from aick_ros.evaluation.scores.evaluation import Evaluation
from aick_ros.evaluation.scores.evaluation import evaluate as evaluate_source
from aick_ros.sources import RgbdSource, SourceOptions, open_source

Plots = Annotated[Path | None, typer.Option(
    '--plots', metavar='DIR', show_default=False,
    help='Folder for plots of the consistency of the covariances (NEES): one PNG for the '
         'odometry and one per gap.')]
Export = Annotated[Path | None, typer.Option(
    '--export', metavar='DIR', show_default=False,
    help='Folder for estimate.SQUARE, the trajectory with its covariances, and reference.SQUARE, '
         'the ground truth at its stamps, for independent scorers such as smfeval.')]


def evaluate(source: options.Source, gaps: options.Gaps = '1,5,10', json: options.JsonFile = None,
             plots: Plots = None, export: Export = None, preset: options.Preset = None,
             config: options.Config = None, assignments: options.Assignments = None,
             camera: options.CameraFile = None,
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

    The consistency of the covariances (NEES, share inside the 95 % ellipsoid) is that of pairs
    at --gaps, of motions along the trajectory over 1, 10, 30 and 100 frames, and of its poses.

    Ctrl-C ends the run with the results up to this point.
    """
    settings = options.settings_from(preset, config, assignments)
    check_target(json, source, config, camera, *settings.files)
    numbers = options.gaps_from(gaps)
    recording = open_source(source, SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval,
        register_depth, depth_info_topic, depth_in_colour))
    if recording.ground_truth is None:
        say(f'{recording.name} has no ground truth: only times are measured, no errors')
    with removed_if_empty(plots, export):
        if plots is not None and recording.ground_truth is not None:
            make_plot_folder(plots)
        if export is not None:
            make_folder(export, '--export')
        with Reading(recording, limit) as reading, progress(reading.name, len(reading)) as done:
            evaluation = evaluate_source(reading, settings, numbers, done, reading.damage,
                                         reading.say)
        _write(evaluation, reading, recording, json, plots, export)
    _say_what_is_missing(evaluation, recording)
    return outcome.of_reading(
        reading, is_untracked=say_if_untracked(recording.name, evaluation.records))


def _write(evaluation: Evaluation, reading: Reading, recording: RgbdSource, json: str | None,
           plots: Path | None, export: Path | None) -> None:
    """Write files first, then show: where nobody reads the figures, printing them ends all."""
    try:
        if plots is not None:
            write_plots(plots, evaluation)
        if export is not None:
            write_square(export, evaluation.records, recording.ground_truth)
    finally:
        if json is not None:
            write_json(json, {**evaluation.to_json(), 'ended': reading.ended,
                              'damaged_images': reading.damage.count})
        show(evaluation, on_stderr=json == STANDARD_OUTPUT)


def _say_what_is_missing(evaluation: Evaluation, recording: RgbdSource) -> None:
    """Say which errors could not be measured, and why."""
    missing = [gap for gap, score in evaluation.pairs.items() if not score.count]
    if recording.ground_truth is not None and missing:
        say(without_pairs(recording.name, evaluation.frames, missing))
    say_limits(recording.name, recording.ground_truth, evaluation.records)
