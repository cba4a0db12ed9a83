# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick view``: a recording, a run or a running node in the viewer Rerun."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from aick_ros.borders.address_space import check_address_space
from aick_ros.borders.names import counted
from aick_ros.borders.open_files import check_open_files
from aick_ros.cli import exit_codes, outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.interruption import Interruption
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.input.ros import without_ros
from aick_ros.cli.output.console import progress, say
from aick_ros.cli.output.target import check_target
from aick_ros.cli.output.viewer import viewer
from aick_ros.errors import InputError
from aick_ros.evaluation.runs import files
from aick_ros.evaluation.runs.run import read_run, reject_demo
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.odometry.complaints import reporting_complaints
from aick_ros.odometry.level_start import begun_level
from aick_ros.ros.process.environment import check_middleware
from aick_ros.settings import Settings
from aick_ros.sources import RgbdSource, SourceOptions, open_source

if TYPE_CHECKING:
    from rerun import RecordingStream

    from aick_ros.reports.rerun_view import RerunView
    from aick_ros.reports.shown_frame import ShownFrame
    from aick_ros.ros.watcher import Watcher

_MEMORY = 4_000_000_000  # [byte] of addresses; measured: 3.5 are used, with fewer rerun may abort
_OPEN_FILES = 32  # chosen: it has 16, and with fewer rerun may abort
_POLL_INTERVAL = 0.2  # [s]; chosen
_PATIENCE = 5.0  # [s] without a message until a hint is printed; chosen
_ABSENCE = 5.0  # [s] without a node until it has ended; chosen: it may be configured anew

ViewSource = Annotated[str | None, typer.Argument(
    metavar='[SOURCE|RUN]', show_default=False,
    help='Recording of any format, on which the odometry runs, or the folder of a run of aick '
         'replay, which has no images.')]
Save = Annotated[Path | None, typer.Option(
    '--save', metavar='FILE.rrd', show_default=False,
    help='Write a file for the viewer, in place of opening it.')]
Web = Annotated[bool, typer.Option(
    '--web', help='Serve the viewer to a browser on this machine until Ctrl-C.')]
Live = Annotated[bool, typer.Option(
    '--live', help='Show what a running odom_node publishes, until Ctrl-C.')]
Namespace = Annotated[str, typer.Option(
    '--namespace', metavar='NAME', show_default=False, help='That of the node, with --live.')]
Remaps = Annotated[list[str] | None, typer.Option(
    '--remap', metavar='FROM:=TO', show_default=False,
    help='A rule of remapping that the node has, with --live; may be repeated.')]


def view(source: ViewSource = None, live: Live = False, namespace: Namespace = '',
         remap: Remaps = None, save: Save = None, web: Web = False, preset: options.Preset = None,
         config: options.Config = None, assignments: options.Assignments = None,
         camera: options.CameraFile = None, colour_topic: options.ColourTopic = None,
         depth_topic: options.DepthTopic = None, info_topic: options.InfoTopic = None,
         ground_truth_topic: options.GroundTruthTopic = None,
         max_interval: options.MaxInterval = SourceOptions.max_interval,
         register_depth: options.RegisterDepth = False,
         depth_info_topic: options.DepthInfoTopic = None,
         depth_in_colour: options.DepthInColour = None,
         limit: options.Limit = None) -> int:
    """
    Show path, covariances, images, depth, matches, keyframes and errors in the viewer Rerun.

    Without --save and --web the viewer opens in a window. With --live it shows a running node.
    """
    check_address_space(_MEMORY, 'the libraries of the viewer')
    check_open_files(_OPEN_FILES, 'the libraries of the viewer')
    settings = options.settings_from(preset, config, assignments)
    reading = SourceOptions(camera, colour_topic, depth_topic, info_topic, ground_truth_topic,
                            max_interval, register_depth, depth_info_topic, depth_in_colour)
    if save is not None and web:
        raise InputError('--save and --web exclude each other: give one of them')
    check_target(None if save is None else str(save), source, config, camera, *settings.files)
    is_plain = settings == Settings() and reading == SourceOptions()
    if live:
        if source is not None or not is_plain:
            raise InputError('--live shows a running node: neither a source nor options of the '
                             'odometry or of recordings have an effect')
        return _watch(namespace, remap or [], save, web, limit)
    if namespace or remap:
        raise InputError('--namespace and --remap are those of a running node: give --live, too')
    if source is None:
        raise InputError('nothing to show: name a recording or a run, or give --live')
    if (Path(source) / files.SUMMARY).exists():
        return _show_run(Path(source), save, web, is_plain and limit is None)
    reject_demo(Path(source))
    return _show_recording(open_source(source, reading), limit, settings, save, web)


def _watch(namespace: str, remaps: list[str], save: Path | None, web: bool,
           limit: int | None) -> int:
    """Show what a node publishes, until Ctrl-C or a number of frames."""
    check_middleware()  # before a file is begun, and before threads are
    try:
        from aick_ros.ros.watcher import check_namespace, watching
    except ModuleNotFoundError as error:
        raise without_ros(error) from None
    check_namespace(namespace)
    from aick_ros.reports.live_view import LiveView
    with (viewer('odom_node', save, web) as stream, Interruption() as interruption,
          watching(LiveView(stream), namespace, remaps) as (watcher, spin)):
        say('Ctrl-C ends')
        hints, ends = _hints(watcher), _ends(watcher, limit)
        while not (interruption.requested or spin.done() or next(ends)):
            time.sleep(_POLL_INTERVAL)
            next(hints, None)
    say(f'{counted(watcher.frames, "frame")} {"was" if watcher.frames == 1 else "were"} shown')
    is_in_vain = limit is not None and not watcher.frames and not interruption.requested
    return exit_codes.UNUSABLE_INPUT if is_in_vain else exit_codes.DONE


def _ends(watcher: Watcher, limit: int | None) -> Iterator[bool]:
    """Yield whether the limit is reached, or never will be as the node has ended, each time."""
    present = time.monotonic()
    while limit is None:
        yield False
    while watcher.frames < limit:
        now = time.monotonic()
        present = present if watcher.is_alone else now
        if now - present > _ABSENCE:
            say(f'odom_node has ended: nobody publishes {watcher.topic} any more, so --limit '
                f'{limit} is not reached')
            break
        yield False
    while True:
        yield True


def _hints(watcher: Watcher) -> Iterator[None]:
    """Say once whether the node is there, or what may be wrong; a step each time it is looked."""
    end = time.monotonic() + _PATIENCE
    while not watcher.hears and time.monotonic() < end:
        yield
    if not watcher.hears:
        say(f'no odom_node publishes {watcher.topic} yet: does it run, with this '
            'ROS_DOMAIN_ID and namespace, and are its topics remapped (--remap)?')
    while not watcher.hears:
        yield
    say(f'odom_node is there: {watcher.topic} is shown')


def _show_run(path: Path, save: Path | None, web: bool, is_plain: bool) -> int:
    """Show what a run has written; without options that it was begun with, or should have been."""
    if not is_plain:
        raise InputError(f'{path} is the folder of a run, on which options of the odometry or of '
                         'recordings, and --limit, have no effect: omit them, or name its '
                         'recording instead')
    run = read_run(path)
    with viewer(run.source, save, web) as stream:
        shown = _view(stream, run.ground_truth)
        for record in run.records:
            shown.add_record(record)
        _wait_for_the_end(web)
    return exit_codes.DONE


def _show_recording(recording: RgbdSource, limit: int | None, settings: Settings,
                    save: Path | None, web: bool) -> int:
    """Show what the odometry makes of a recording."""
    with viewer(recording.name, save, web) as stream:
        code = _run(recording, limit, settings, _view(stream, recording.ground_truth))
        _wait_for_the_end(web)
        return code


def _run(recording: RgbdSource, limit: int | None, settings: Settings, shown: RerunView) -> int:
    """Run the odometry on a recording and show each frame, in the frame of ``aick replay``."""
    count = 0
    with Reading(recording, limit) as reading, progress(reading.name, len(reading)) as show:
        odometry = Odometry(settings)
        frames = reporting_complaints(odometry, _registered(reading, odometry, show), reading.say)
        for count, frame in enumerate(begun_level(odometry, settings.imu, frames), 1):
            shown.add(frame)
    if not count:
        raise InputError(f'{recording.name} has no usable frame')
    return outcome.of_reading(reading)


def _registered(reading: Reading, odometry: Odometry,
                show: Callable[[int], None]) -> Iterator[ShownFrame]:
    from aick_ros.reports.shown_frame import ShownFrame
    for count, frame in enumerate(reading.frames(reading.damage), 1):
        yield ShownFrame.of(odometry.register_frame(frame))
        show(count)


def _view(stream: RecordingStream, ground_truth: Trajectory | None) -> RerunView:
    from aick_ros.reports.rerun_view import RerunView
    return RerunView(stream, ground_truth)


def _wait_for_the_end(web: bool) -> None:
    """Serve a browser until Ctrl-C; a window needs this program no longer."""
    if web:
        with Interruption() as interruption:
            say('Ctrl-C ends the viewer')
            while not interruption.requested:
                time.sleep(_POLL_INTERVAL)
