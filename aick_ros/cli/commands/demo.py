# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick demo``: the ROS node on a rendered or recorded sequence, over DDS."""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.input.ros import without_ros
from aick_ros.cli.output.console import line, progress, say, table
from aick_ros.cli.output.demo_report import live_statistics, plot_path, table_rows
from aick_ros.cli.output.files import write_json
from aick_ros.cli.output.run_folder import whole_folder
from aick_ros.cli.output.target import STANDARD_OUTPUT, check_parent, check_target
from aick_ros.errors import InputError
from aick_ros.evaluation.runs import files
from aick_ros.evaluation.scores.trajectory_errors import compare
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory, write_trajectory
from aick_ros.ros.process.environment import check_middleware
from aick_ros.settings.parameter import Value
from aick_ros.sources import BAG_FLAGS, RgbdSource, SourceOptions, open_source, reject
from aick_ros.sources.bag import BagSource
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers import bag_writer

if TYPE_CHECKING:
    from aick_ros.ros.playback.answers import LiveRun

_NODE_TOPICS = ('rgb/image', 'depth/image', 'rgb/camera_info')
_WRITTEN_TOPICS = (bag_writer.COLOUR_TOPIC, bag_writer.DEPTH_TOPIC, bag_writer.INFO_TOPIC)
_LAST_DOMAIN = 101  # by definition: the last one whose ports no ephemeral port can take
_CAMERA_IN_BASE = (0.0, 0.0, 0.0, -0.5, 0.5, -0.5, 0.5)
"""By definition: an optical frame (z forward) at the origin of its base (x forward), REP 103."""

Topics = tuple[str, str, str]
"""Colour images, depth images, camera_info."""

Recording = Annotated[str | None, typer.Argument(
    metavar='[SOURCE]', show_default=False,
    help='Recording to play: a ROS bag, a TUM folder, ... Without it, a sequence is rendered.')]
Parent = Annotated[Path, typer.Option(
    '--out', metavar='DIR', help='Folder in which the folder of the run is made.')]
Frames = Annotated[int, typer.Option(
    '--frames', metavar='N', min=2, help='Number of frames of the rendered sequence.')]
Rate = Annotated[float, typer.Option(
    '--rate', metavar='FACTOR', min=0.01, help='Speed of the playback; 1 is as recorded.')]


def demo(source: Recording = None, out: Parent = Path('runs'), frames: Frames = 300,
         rate: Rate = 1.0, register_depth: options.RegisterDepth = False,
         depth_info_topic: options.DepthInfoTopic = None,
         depth_in_colour: options.DepthInColour = None,
         json: options.JsonFile = None) -> int:
    """
    Start the ROS node, play a recording to it over DDS, and evaluate the odometry it publishes.

    No message leaves this machine. Ctrl-C ends it without a trace.
    """
    check_target(json, source)
    check_parent(out, '--out')
    play = _player(rate)
    recording = _recording(source, frames, SourceOptions(
        register_depth=register_depth, depth_info_topic=depth_info_topic,
        depth_in_colour=depth_in_colour))
    damage = DamageLog()
    with whole_folder(out, f'{files.DEMO}{recording.name}', datetime.now()) as folder:
        bag, topics = _playable_bag(source, recording, folder, damage)
        with progress('playing to odom_node', len(recording)) as show:
            run = play(bag, topics, show)
        estimate = _published(run, recording.name)
        write_trajectory(folder / files.TRAJECTORY, estimate)
    truth, is_tracked = _of_base(recording.ground_truth), any(a.tracked for a in run.answers)
    statistics = live_statistics(
        recording.name, run, compare(estimate, truth) if truth and is_tracked else None)
    if json is not None:
        write_json(json, statistics)
    on_stderr = json == STANDARD_OUTPUT
    table(f'odom_node on {recording.name}', table_rows(statistics), on_stderr=on_stderr)
    line(f'trajectory of base_link: {folder / files.TRAJECTORY}', on_stderr)
    images = open_source(bag, SourceOptions(None, *topics))
    plot = plot_path(folder / 'trajectory.png', recording.name, estimate, truth, images)
    line(f'plot: {plot}', on_stderr)
    if bag.is_relative_to(folder):
        line(f'played bag (may be deleted): {bag}', on_stderr)
    if not is_tracked:
        say(f'no frame of {recording.name} was tracked: see the log of odom_node above')
    return outcome.of_damage(damage, is_untracked=not is_tracked)


def _published(run: LiveRun, name: str) -> Trajectory:
    """Return the trajectory that the node published; InputError where there is none."""
    if not run.answers:
        raise InputError(f'odom_node answered none of the {len(run.published_at)} frames of '
                         f'{name}: see its log above')
    return Trajectory(np.array([answer.stamp for answer in run.answers]),
                      np.array([answer.T_odom_base for answer in run.answers]))


def _recording(path: str | None, frames: int, reading: SourceOptions) -> RgbdSource:
    """Return the recording of the user, or a rendered one."""
    if path is not None:
        return open_source(path, reading)
    reject(reading, 'a rendered recording', *BAG_FLAGS)
    return SyntheticSource(SyntheticOptions(frames=frames))


def _player(rate: float) -> Callable[[Path, Topics, Callable[[int], None]], LiveRun]:
    """
    Return a function that plays a bag to a node which no other ROS program can hear or disturb.

    :raises InputError: where ROS 2 is not installed.
    """
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, _LAST_DOMAIN))
    check_middleware()
    try:
        from aick_ros.ros.playback.live_run import run_live
        from aick_ros.ros.playback.pace import RealTime
    except ModuleNotFoundError as error:
        raise without_ros(error) from None
    parameters: dict[str, Value] = {
        'process_every_frame': True, 'camera_in_base': _CAMERA_IN_BASE, 'topic_queue_size': 30}
    return lambda bag, topics, on_progress: run_live(
        bag, dict(zip(_NODE_TOPICS, topics)), parameters, RealTime(rate), on_progress=on_progress)


def _playable_bag(path: str | None, source: RgbdSource, folder: Path,
                  damage: DamageLog) -> tuple[Path, Topics]:
    """Return a ROS 2 bag of raw images, that of the user or a new one, and its topics."""
    if (path and isinstance(source, BagSource) and source.raw_topics
            and (Path(path) / 'metadata.yaml').is_file()):
        _require_frame(source, damage)
        return Path(path), source.raw_topics
    bag = folder / files.BAG
    with progress(f'writing {bag}', len(source)) as show:
        bag_writer.write_bag(bag, source, on_damaged=damage,
                             progress=lambda written, total: show(written))
    return bag, _WRITTEN_TOPICS


def _require_frame(source: RgbdSource, damage: DamageLog) -> None:
    """Raise InputError where the node could answer no frame, before it is started."""
    if next(Reading(source, 1, damage, ahead=False).frames(damage), None) is None:
        raise InputError(f'{source.name} has no usable frame')


def _of_base(camera: Trajectory | None) -> Trajectory | None:
    """Return the trajectory of the base that carries the camera."""
    if camera is None:
        return None
    T_base_camera = se3.from_quaternion(_CAMERA_IN_BASE[3:], _CAMERA_IN_BASE[:3])
    return Trajectory(camera.stamps, camera.poses @ se3.inverse(T_base_camera))
