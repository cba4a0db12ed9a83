# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick view``: a recording or a run in the viewer Rerun."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import quote

import typer

from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.interruption import Interruption
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.output.console import progress, say
from aick_ros.cli.output.target import check_target
from aick_ros.errors import InputError, installation, package_of
from aick_ros.evaluation.runs import files
from aick_ros.evaluation.runs.run import read_run
from aick_ros.geometry.trajectory import Trajectory
from aick_ros.odometry import Odometry
from aick_ros.settings import Settings
from aick_ros.sources import RgbdSource, SourceOptions, open_source

if TYPE_CHECKING:
    from rerun import RecordingStream

    from aick_ros.reports.rerun_view import RerunView

_POLL_INTERVAL = 0.2  # [s]; chosen
_WEB_PORT = 9090  # by definition: the default of Rerun

ViewSource = Annotated[str, typer.Argument(
    metavar='SOURCE|RUN', show_default=False,
    help='Recording of any format, on which the odometry runs, or the folder of a run of aick '
         'replay, which has no images.')]
Save = Annotated[Path | None, typer.Option(
    '--save', metavar='FILE.rrd', show_default=False,
    help='Write a file for the viewer, in place of opening it.')]
Web = Annotated[bool, typer.Option(
    '--web', help='Serve the viewer to a browser on this machine until Ctrl-C.')]


def view(source: ViewSource, save: Save = None, web: Web = False, preset: options.Preset = None,
         config: options.Config = None, assignments: options.Assignments = None,
         camera: options.CameraFile = None, colour_topic: options.ColourTopic = None,
         depth_topic: options.DepthTopic = None, info_topic: options.InfoTopic = None,
         ground_truth_topic: options.GroundTruthTopic = None,
         max_interval: options.MaxInterval = SourceOptions.max_interval,
         limit: options.Limit = None) -> int:
    """
    Show path, covariances, images, depth, matches, keyframes and errors in the viewer Rerun.

    Without --save and --web the viewer opens in a window.
    """
    settings = options.settings_from(preset, config, assignments)
    if save is not None and web:
        raise InputError('--save and --web exclude each other: give one of them')
    check_target(None if save is None else str(save), source)
    if (Path(source) / files.SUMMARY).exists():
        run = read_run(Path(source))
        with _viewer(run.source, save, web) as stream:
            shown = _view(stream, run.ground_truth)
            for record in run.records:
                shown.add_record(record)
        return outcome.DONE
    recording = open_source(source, SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval))
    with _viewer(recording.name, save, web) as stream:
        return _run(recording, limit, settings, _view(stream, recording.ground_truth))


def _run(recording: RgbdSource, limit: int | None, settings: Settings, shown: RerunView) -> int:
    """Run the odometry on a recording and show each frame."""
    odometry, count = Odometry(settings), 0
    with Reading(recording, limit) as reading, progress(reading.name, len(reading)) as show:
        for count, frame in enumerate(reading.frames(reading.damage), 1):
            shown.add(odometry.register_frame(frame))
            show(count)
    if not count:
        raise InputError(f'{recording.name} has no usable frame')
    return outcome.of_reading(reading)


def _view(stream: RecordingStream, ground_truth: Trajectory | None) -> RerunView:
    from aick_ros.reports.rerun_view import RerunView
    return RerunView(stream, ground_truth)


@contextmanager
def _viewer(name: str, save: Path | None, web: bool) -> Iterator[RecordingStream]:
    """
    Give what to log to: a file, a viewer in a browser, or one in a window.

    :raises InputError: where Rerun is missing, or has no window.
    """
    try:
        import rerun as rr
    except ModuleNotFoundError as error:
        raise InputError(f"no view without {package_of(error)}: {installation('view')}") from None
    with rr.RecordingStream('aick_ros', recording_id=None) as stream:
        stream.send_recording_name(name)
        if save is not None:
            stream.save(save)
        elif web:
            _serve(stream)
        else:
            _open_window(stream)
        yield stream
        stream.flush()
        if web:
            with Interruption() as interruption:
                say('Ctrl-C ends the viewer')
                while not interruption.requested:
                    time.sleep(_POLL_INTERVAL)


def _serve(stream: RecordingStream) -> None:
    import rerun as rr
    data = stream.serve_grpc()
    rr.serve_web_viewer(web_port=_WEB_PORT, open_browser=False)
    say(f'the viewer is at http://127.0.0.1:{_WEB_PORT}/?url={quote(data, safe="")}')


def _open_window(stream: RecordingStream) -> None:
    if not (os.environ.get('DISPLAY') or os.environ.get('WAYLAND_DISPLAY')):
        raise InputError('there is no display for the window of the viewer: give --web for a '
                         'browser, or --save FILE.rrd')
    stream.spawn()
