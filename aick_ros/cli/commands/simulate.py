# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick simulate``: a rendered recording with exact ground truth."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.borders.names import counted
from aick_ros.cli.output.console import progress
from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.sources import raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS
from aick_ros.sources.writers.bag_writer import write_bag
from aick_ros.sources.writers.new_folder import check_new
from aick_ros.sources.writers.tum_writer import write_tum

_FOCAL_LENGTH = 525 / 640
"""By definition: focal length of a Kinect, relative to the width of the image."""

_SMALLEST, _LARGEST = 16, 4096  # [px]; chosen


class ImuName(str, Enum):
    """Models of IMUs."""

    BMI055 = 'bmi055'
    BMI085 = 'bmi085'
    ICM42688 = 'icm42688'
    PERFECT = 'perfect'


class Format(str, Enum):
    """Format of the rendered recording."""

    MCAP = 'mcap'
    SQLITE3 = 'sqlite3'
    TUM = 'tum'


Out = Annotated[Path, typer.Argument(
    metavar='OUT', show_default=False, help='Folder of the new recording; it must not exist.')]
Form = Annotated[Format, typer.Option(
    '--format', help='ROS 2 bag in MCAP or SQLite storage, or a TUM folder.')]
Frames = Annotated[int, typer.Option('--frames', metavar='N', min=1, help='Number of frames.')]
Seed = Annotated[int, typer.Option(
    '--seed', metavar='N', min=0, help='Seed of the room and of the path of the camera.')]
Rate = Annotated[float, typer.Option('--rate', metavar='HZ', help='Frames per second.')]
Size = Annotated[str, typer.Option(
    '--size', metavar='WIDTHxHEIGHT', help='Size of the images in pixels.')]
Perfect = Annotated[bool, typer.Option(
    '--perfect', help='Render without noise, motion blur, exposure changes and missing depth.')]
Imu = Annotated[ImuName | None, typer.Option(
    '--imu', show_default=False, case_sensitive=False,
    help='Add the samples of an IMU with the noise of this model, at 200 Hz; in bags only.')]


def simulate(out: Out, format: Form = Format.MCAP, frames: Frames = 150, seed: Seed = 0,
             rate: Rate = 30.0, size: Size = '640x480', perfect: Perfect = False,
             imu: Imu = None) -> int:
    """
    Render a recording of a handheld camera in a furnished room, with exact ground truth.

    The recording appears when it is complete; Ctrl-C leaves no files behind.
    """
    make = SyntheticOptions.perfect if perfect else SyntheticOptions
    if imu is not None and format is Format.TUM:
        raise InputError('--imu has no effect with --format tum, which has no gyroscope: write a '
                         'bag')
    check_new(out)  # before the room is built
    source = SyntheticSource(make(seed=seed, frames=frames, rate=rate, camera=_camera(size),
                                  imu=None if imu is None else IMU_MODELS[imu.value]))
    with progress(source.name, frames) as show:
        if format is Format.TUM:
            count = write_tum(out, source, raise_damage, lambda written, total: show(written))
        else:
            count = write_bag(out, source, format.value, on_damaged=raise_damage,
                              progress=lambda written, total: show(written))
    typer.echo(f'{counted(count, "frame")} in {out}')
    return 0


def _camera(size: str) -> Camera:
    sides = size.split('x')
    if not (len(sides) == 2 and all(side.isdecimal() for side in sides)
            and all(_SMALLEST <= int(side) <= _LARGEST for side in sides)):
        raise InputError(f'--size {size}: WIDTHxHEIGHT with whole numbers from {_SMALLEST} to '
                         f'{_LARGEST} is required, for example --size 640x480')
    width, height = map(int, sides)
    focal_length = _FOCAL_LENGTH * width
    return Camera(width, height, focal_length, focal_length, (width - 1) / 2, (height - 1) / 2)
