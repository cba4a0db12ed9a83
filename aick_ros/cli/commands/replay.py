# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick replay``: runs the odometry on a recording and writes a folder of results."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime
from itertools import chain
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.reading import COMPLETE, Reading
from aick_ros.cli.output.console import decimal, progress, say, table
from aick_ros.cli.output.evaluation_tables import error_rows
from aick_ros.cli.output.files import write_json, write_whole
from aick_ros.cli.output.ground_truth_limits import say_limits
from aick_ros.cli.output.run_folder import RunFolder
from aick_ros.cli.output.target import STANDARD_OUTPUT, check_parent, check_target
from aick_ros.cli.output.untracked import say_if_untracked
from aick_ros.errors import InputError, installation, package_of
from aick_ros.evaluation.scores.frame_record import FrameRecord
from aick_ros.evaluation.scores.run_summary import RunSummary, summarize
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.odometry.complaints import reporting_complaints
from aick_ros.odometry.level_start import begun_level
from aick_ros.registration.status import Status
from aick_ros.settings import Settings
from aick_ros.sources import SourceOptions, open_source

Out = Annotated[Path, typer.Option(
    '--out', metavar='DIR', help='Folder in which the folder SOURCE-TIME of the run is made.')]


def replay(source: options.Source, out: Out = Path('runs'), preset: options.Preset = None,
           config: options.Config = None, assignments: options.Assignments = None,
           camera: options.CameraFile = None, colour_topic: options.ColourTopic = None,
           depth_topic: options.DepthTopic = None, info_topic: options.InfoTopic = None,
           ground_truth_topic: options.GroundTruthTopic = None,
           max_interval: options.MaxInterval = SourceOptions.max_interval,
           register_depth: options.RegisterDepth = False,
           depth_info_topic: options.DepthInfoTopic = None,
           depth_in_colour: options.DepthInColour = None,
           limit: options.Limit = None, json: options.JsonFile = None) -> int:
    """
    Run the odometry on a recording, as fast as possible.

    Writes the trajectory, a table of all frames, a summary, the settings and an HTML report.
    Ctrl-C ends the run with all files complete up to this point.
    """
    settings = options.settings_from(preset, config, assignments)
    check_target(json, source, config, camera, *settings.files)
    check_parent(out, '--out')
    recording = open_source(source, SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval,
        register_depth, depth_info_topic, depth_in_colour))
    with Reading(recording, limit) as reading:
        folder, summary = _run(reading, settings, out, json)
    _show(summary, folder, on_stderr=json == STANDARD_OUTPUT)
    return outcome.of_reading(reading, is_untracked=not summary.tracked)


def _run(reading: Reading, settings: Settings, out: Path,
         json: str | None) -> tuple[Path, RunSummary]:
    started, records = datetime.now(), list[FrameRecord]()
    ground_truth = reading.ground_truth
    start = time.perf_counter()
    with progress(reading.name, len(reading)) as show:
        updates = _updates(reading, settings, show)
        first = next(updates, None)
        if first is None:
            raise InputError(f'{reading.name} has no usable frame')
        with RunFolder(out, reading.name, settings, started) as folder:
            if ground_truth is not None:
                folder.write_ground_truth(ground_truth)
            for record in _added(folder, chain([first], updates), reading):
                records.append(record)
    summary = summarize(reading, records, settings, time.perf_counter() - start, reading.ended,
                        reading.damage.count)
    try:
        folder.write_summary(summary)
        _write_report(folder.path, summary, records, ground_truth, started)
    finally:  # it may be on another disk than the one that is full
        if json is not None:
            write_json(json, summary.to_json())
    if not say_if_untracked(reading.name, records):
        say_limits(reading.name, ground_truth, records)
    return folder.path, summary


def _added(folder: RunFolder, records: Iterable[FrameRecord],
           reading: Reading) -> Iterator[FrameRecord]:
    """Write frames, and yield those that are; a full disk after the first one ends the reading."""
    for count, record in enumerate(records):
        try:
            folder.add(record)
        except InputError as error:
            if not count:
                raise
            reading.ended = str(error)
            return
        yield record


def _updates(reading: Reading, settings: Settings,
             show: Callable[[int], None]) -> Iterator[FrameRecord]:
    odometry = Odometry(settings)
    records = reporting_complaints(odometry, _records(reading, odometry, show), reading.say)
    return begun_level(odometry, settings.imu, records)


def _records(reading: Reading, odometry: Odometry,
             show: Callable[[int], None]) -> Iterator[FrameRecord]:
    for count, frame in enumerate(reading.frames(reading.damage), 1):
        yield FrameRecord.of(odometry.register_frame(frame))
        show(count)


def _write_report(folder: Path, summary: RunSummary, records: list[FrameRecord],
                  ground_truth: Trajectory | None, started: datetime) -> None:
    try:
        from aick_ros.reports.run_report import report
    except ModuleNotFoundError as error:
        say(f"no report.html without {package_of(error)}: {installation('eval')}")
        return
    write_whole(folder / 'report.html', report(summary, records, ground_truth, started))


def _show(summary: RunSummary, folder: Path, on_stderr: bool) -> None:
    score = summary.trajectory
    rows = [
        ('frames', str(summary.frames)),
        *([('images skipped', str(summary.damaged_images))] if summary.damaged_images else []),
        ('tracked', f'{summary.tracked} ({100 * summary.tracked / summary.frames:.1f} %)'),
        ('frames per second', decimal(summary.frames_per_second, digits=1)),
        ('path length', decimal(summary.path_length_m, ' m')),
        ('start to end', decimal(summary.end_distance_m, ' m')),
    ]
    lost = {name: count for name, count in summary.status.items() if not Status[name].ok}
    if lost:
        rows.append(('not tracked', ', '.join(f'{count} {Status[name].value}'
                                              for name, count in lost.items())))
    if score.ate_rmse_m is not None and summary.tracked > 1:
        rows += error_rows(score, summary.frames)
    if summary.ended != COMPLETE:
        rows.append(('ended', summary.ended))
    table(summary.source, [*rows, ('files', str(folder))], on_stderr=on_stderr)
