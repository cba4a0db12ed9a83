# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick convert``: writes any recording as a ROS 2 bag."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from aick_ros.borders.names import counted
from aick_ros.cli import outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.output.console import progress
from aick_ros.sources import SourceOptions, open_source
from aick_ros.sources.writers.bag_writer import STORAGES, write_bag

Out = Annotated[Path, typer.Argument(
    metavar='OUT', show_default=False, help='Folder of the new bag; it must not exist.')]
Storage = Annotated[str, typer.Option(
    '--storage', metavar='|'.join(STORAGES), help='Storage of the bag.')]
DepthEncoding = Annotated[str, typer.Option(
    '--depth-encoding', metavar='32FC1|16UC1',
    help='32FC1 keeps the depth exactly; 16UC1 rounds it to millimetres, in half the space.')]


def convert(source: options.Source, out: Out, storage: Storage = 'mcap',
            depth_encoding: DepthEncoding = '32FC1', camera: options.CameraFile = None,
            colour_topic: options.ColourTopic = None, depth_topic: options.DepthTopic = None,
            info_topic: options.InfoTopic = None,
            ground_truth_topic: options.GroundTruthTopic = None,
            max_interval: options.MaxInterval = SourceOptions.max_interval,
            register_depth: options.RegisterDepth = False,
            depth_info_topic: options.DepthInfoTopic = None,
            depth_in_colour: options.DepthInColour = None,
            limit: options.Limit = None) -> int:
    """
    Write a recording as a ROS 2 bag: Image, CameraInfo, ground truth as PoseStamped.

    The bag appears when it is complete; Ctrl-C leaves no files behind.
    """
    recording = open_source(source, SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval,
        register_depth, depth_info_topic, depth_in_colour))
    reading = Reading(recording, limit)
    with progress(reading.name, len(reading)) as show:
        frames = write_bag(out, reading, storage, depth_encoding, reading.damage,
                           lambda written, total: show(written))
    typer.echo(f'{counted(frames, "frame")} in {out}')
    return outcome.of_reading(reading)
