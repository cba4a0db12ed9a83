# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick demo``: the real node on a rendered or recorded sequence, over DDS."""

from __future__ import annotations

import os
import random
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.output import console
from aick_ros.cli.output.files import STANDARD_OUTPUT, check_target, write_json
from aick_ros.cli.output.run_folder import lead_to, make_folder
from aick_ros.errors import InputError
from aick_ros.evaluation.scores.statistics import Percentiles, root_mean_square
from aick_ros.evaluation.scores.trajectory_errors import TrajectoryErrors, compare
from aick_ros.frames.keypoints import KeypointExtractor
from aick_ros.geometry import se3
from aick_ros.geometry.trajectory import Trajectory, write_trajectory
from aick_ros.settings import Settings
from aick_ros.sources import RgbdSource, SourceOptions, open_source
from aick_ros.sources.bag import BagSource
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers import bag_writer

if TYPE_CHECKING:
    from aick_ros.ros.playback.live_run import LiveRun

_NODE_TOPICS = ('rgb/image', 'depth/image', 'rgb/camera_info')
_WRITTEN_TOPICS = (bag_writer.COLOUR_TOPIC, bag_writer.DEPTH_TOPIC, bag_writer.INFO_TOPIC)
_LAST_DOMAIN = 101  # of those whose ports the system does not hand out
_VIEWS = 4  # images of the recording above the picture of the path
_CAMERA_IN_BASE = (0.0, 0.0, 0.0, -0.5, 0.5, -0.5, 0.5)
"""An optical frame (z forward) in a base (x forward) at the same place (REP-103)."""

Recording = Annotated[str | None, typer.Argument(
    metavar='[SOURCE]', show_default=False,
    help='A bag, a TUM folder or any other source; without it a sequence is rendered.')]
Parent = Annotated[Path, typer.Option(
    '--out', metavar='DIR', help='Where the folder of the run is made.')]
Frames = Annotated[int, typer.Option(
    '--frames', metavar='N', min=2, help='Length of the rendered sequence.')]
Rate = Annotated[float, typer.Option(
    '--rate', metavar='TIMES', min=0.01, help='How many times as fast as recorded to play.')]


def demo(source: Recording = None, out: Parent = Path('runs'), frames: Frames = 300,
         rate: Rate = 1.0, json: options.JsonFile = None) -> int:
    """
    Start the ROS node, play a recording to it over DDS and show what it answers.

    Nothing leaves this machine.
    """
    if json is not None:
        check_target(json)
    # a robot that runs on this machine must neither hear the demo nor be heard by it
    os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
    os.environ['ROS_DOMAIN_ID'] = str(random.randint(1, _LAST_DOMAIN))
    try:
        from aick_ros.ros.playback.live_run import run_live
        from aick_ros.ros.playback.pace import RealTime
    except ModuleNotFoundError as error:
        raise InputError(f'the node needs ROS 2 and {error.name} is not there: source a ROS 2 '
                         "Jazzy workspace, or pip install 'aick_ros[ros]'") from None
    opened = open_source(source) if source else SyntheticSource(SyntheticOptions(frames=frames))
    folder = make_folder(out, f'demo-{opened.name}', datetime.now())
    lead_to(folder)
    damage = DamageLog()
    bag, topics = _playable_bag(source, opened, folder, damage)
    with console.progress('playing to odom_node', len(opened)) as show:
        run = run_live(
            bag, dict(zip(_NODE_TOPICS, topics)),
            {'process_every_frame': True, 'camera_in_base': _CAMERA_IN_BASE,
             'topic_queue_size': 30}, RealTime(rate), on_progress=show)
    if not run.answers:
        raise InputError(f'odom_node answered none of the {len(run.published_at)} frames of '
                         f'{opened.name}; its log above says why')
    estimate = Trajectory(np.array([answer.stamp for answer in run.answers]),
                          np.array([answer.T_odom_base for answer in run.answers]))
    truth = _of_base(opened.ground_truth)
    write_trajectory(folder / 'trajectory.tum', estimate)
    figures = _figures(opened.name, run, compare(estimate, truth) if truth else None)
    if json is not None:
        write_json(json, figures)
    on_stderr = json == STANDARD_OUTPUT
    console.table(f'odom_node on {opened.name}', _rows(figures), on_stderr=on_stderr)
    typer.echo(f'path of base_link: {folder / "trajectory.tum"}', err=on_stderr)
    picture = _draw(folder / 'trajectory.png', opened.name, estimate, truth, bag, topics)
    typer.echo(f'its picture: {picture}', err=on_stderr)
    if bag.is_relative_to(folder):
        typer.echo(f'the bag that was played (may be deleted): {bag}', err=on_stderr)
    damage.close()
    return outcome.UNUSABLE_INPUT if damage.count else outcome.DONE


def _playable_bag(path: str | None, source: RgbdSource, folder: Path,
                  damage: DamageLog) -> tuple[Path, tuple[str, str, str]]:
    """Return a ROS 2 bag of raw images, the user's own or a new one, and its topics."""
    if isinstance(source, BagSource) and source.raw_topics and (
            Path(path) / 'metadata.yaml').is_file():
        return Path(path), source.raw_topics
    bag = folder / 'bag'
    with console.progress(f'writing {bag}', len(source)) as show:
        bag_writer.write_bag(bag, source, on_damaged=damage,
                             progress=lambda written, total: show(written))
    return bag, _WRITTEN_TOPICS


def _of_base(camera: Trajectory | None) -> Trajectory | None:
    """Return the path of the base that carries the camera."""
    if camera is None:
        return None
    T_base_camera = se3.from_quaternion(_CAMERA_IN_BASE[3:], _CAMERA_IN_BASE[:3])
    return Trajectory(camera.stamps, camera.poses @ se3.inverse(T_base_camera))


def _figures(name: str, run: LiveRun, errors: TrajectoryErrors | None) -> dict[str, Any]:
    translations, rotations = errors.relative(1.0) if errors else ((), ())
    return {
        'source': name,
        'frames_played': len(run.published_at),
        'frames_answered': len(run.answers),
        'frames_not_tracked': sum(not answer.tracked for answer in run.answers),
        'rate_hz': run.rate,
        'delay_ms': asdict(Percentiles.of(1e3 * run.delays)),
        'trajectory': {
            'rpe_1s_translation_rmse_m': root_mean_square(translations),
            'rpe_1s_rotation_rmse_deg': root_mean_square(np.degrees(rotations)),
            'ate_rmse_m': root_mean_square(errors.positions()) if errors else None}}


def _rows(figures: dict[str, Any]) -> list[tuple[str, str]]:
    delay, trajectory = figures['delay_ms'], figures['trajectory']
    return [
        ('frames played / answered',
         f'{figures["frames_played"]} / {figures["frames_answered"]}'),
        ('of these not tracked', str(figures['frames_not_tracked'])),
        ('rate', console.figure(figures['rate_hz'], ' Hz', 2)),
        ('delay, image to odometry, p50 / p99',
         f'{console.figure(delay["p50"], digits=1)} / {console.figure(delay["p99"], " ms", 1)}'),
        ('RPE over 1 s, translation',
         console.figure(trajectory['rpe_1s_translation_rmse_m'], ' m', 4)),
        ('RPE over 1 s, rotation',
         console.figure(trajectory['rpe_1s_rotation_rmse_deg'], ' deg', 2)),
        ('ATE', console.figure(trajectory['ate_rmse_m'], ' m', 4))]


def _draw(path: Path, name: str, estimate: Trajectory, truth: Trajectory | None, bag: Path,
          topics: tuple[str, str, str]) -> str:
    try:
        from aick_ros.reports.path_plot import View, plot_trajectory
    except ModuleNotFoundError as error:
        return f"not drawn, {error.name} is not there: pip install 'aick_ros[eval]'"
    recording = open_source(bag, SourceOptions(None, *topics))
    extractor = KeypointExtractor(Settings().features, Settings().sensor)
    shown = set(np.linspace(0, len(recording) - 1, _VIEWS, dtype=int))
    views = [View(frame.colour, extractor.extract(frame).pixels)
             for i, frame in enumerate(recording.frames(lambda damage: None)) if i in shown]
    aligned = ', aligned to the ground truth' if truth else ''
    plot_trajectory(path, estimate, truth,
                    f'odom_node on {name}: views, and the path it published{aligned}', views)
    return str(path)
