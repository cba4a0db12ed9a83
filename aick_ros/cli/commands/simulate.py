# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick simulate``: a rendered recording with exact ground truth."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli.output.console import progress
from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.sources import raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.writers.bag_writer import write_bag
from aick_ros.sources.writers.tum_writer import write_tum

_FOCAL_LENGTH = 525 / 640
"""Of the camera, as a share of the image's width: that of a Kinect."""

_LARGEST = 4096


class Format(str, Enum):
    """What a rendered recording is written as."""

    MCAP = 'mcap'
    SQLITE3 = 'sqlite3'
    TUM = 'tum'


Out = Annotated[Path, typer.Argument(
    metavar='OUT', show_default=False, help='The folder of the new recording.')]
Form = Annotated[Format, typer.Option(
    '--format', help='A ROS 2 bag in one of two storages, or a TUM folder.')]
Frames = Annotated[int, typer.Option('--frames', metavar='N', min=1, help='How many.')]
Seed = Annotated[int, typer.Option(
    '--seed', metavar='N', min=0, help='Another one is another room and another path.')]
Rate = Annotated[float, typer.Option('--rate', metavar='HZ', help='Frames a second.')]
Size = Annotated[str, typer.Option('--size', metavar='WIDTHxHEIGHT', help='Of the images.')]
Perfect = Annotated[bool, typer.Option(
    '--perfect', help='Without noise, blur, changes of exposure and holes in the depth.')]


def simulate(out: Out, format: Form = Format.MCAP, frames: Frames = 150, seed: Seed = 0,
             rate: Rate = 30.0, size: Size = '640x480', perfect: Perfect = False) -> int:
    """
    Render a handheld camera's recording of a furnished room, with exact ground truth.

    It appears when it is complete; Ctrl-C leaves nothing behind.
    """
    make = SyntheticOptions.perfect if perfect else SyntheticOptions
    source = SyntheticSource(make(seed=seed, frames=frames, rate=rate, camera=_camera(size)))
    with progress(source.name, frames) as show:
        if format is Format.TUM:
            count = write_tum(out, source, raise_damage, lambda written, total: show(written))
        else:
            count = write_bag(out, source, format.value, on_damaged=raise_damage,
                              progress=lambda written, total: show(written))
    typer.echo(f'{count} frames in {out}')
    return 0


def _camera(size: str) -> Camera:
    width, _, height = size.partition('x')
    if not (width.isdecimal() and height.isdecimal()
            and 16 <= min(int(width), int(height)) <= max(int(width), int(height)) <= _LARGEST):
        raise InputError(f'--size {size}: it takes two whole numbers from 16 to {_LARGEST}, for '
                         'example 640x480')
    width, height = int(width), int(height)
    focal_length = _FOCAL_LENGTH * width
    return Camera(width, height, focal_length, focal_length, (width - 1) / 2, (height - 1) / 2)
