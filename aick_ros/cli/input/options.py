# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Options shared by several commands, and the settings they give."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.cli.input.settings_file import read_settings_file
from aick_ros.errors import InputError
from aick_ros.evaluation.engine.requirements import check_dask
from aick_ros.settings import Settings
from aick_ros.settings.node import NodeSettings
from aick_ros.settings.parameter import values, with_values
from aick_ros.settings.presets import PRESETS, preset

DEPTH_IN_COLOUR = '--depth-in-colour'
SEVEN_NUMBERS = (f'{DEPTH_IN_COLOUR} requires seven numbers, separated by blanks: the position '
                 'x y z [m] and the quaternion qx qy qz qw')
"""The sentence for other values."""

Source = Annotated[str, typer.Argument(
    metavar='SOURCE', show_default=False,
    help='Recording: a ROS 2 bag (folder, .mcap or .db3), a ROS 1 bag, a TUM folder, a folder of '
         'numbered colour and depth files, or synthetic:SEED, which is rendered.')]

Preset = Annotated[str | None, typer.Option(
    '--preset', metavar='|'.join(PRESETS), show_default=False,
    help='Start from parameters of the paper, or from those for small computers (embedded), '
         'instead of the defaults.')]
Config = Annotated[Path | None, typer.Option(
    '--config', metavar='FILE', show_default=False,
    help='Parameter file (YAML) of the node; its values override the defaults, and those of a '
         'preset, which it may name itself.')]
Assignments = Annotated[list[str] | None, typer.Option(
    '--set', metavar='NAME=VALUE', show_default=False,
    help='Set one parameter, for example aick.alpha=0.7; it overrides preset and file. May be '
         'repeated. "aick parameters" lists all parameters.')]

CameraFile = Annotated[Path | None, typer.Option(
    '--camera', metavar='FILE', show_default=False,
    help='Calibration that replaces that of the recording: camera.json, or the YAML file of '
         'camera_calibration (ROS).')]
ColourTopic = Annotated[str | None, typer.Option(
    '--colour-topic', metavar='TOPIC', show_default=False,
    help='Topic of the colour images in a bag. Default: found by type and name.')]
DepthTopic = Annotated[str | None, typer.Option(
    '--depth-topic', metavar='TOPIC', show_default=False,
    help='Topic of the depth images in a bag. Default: found by type and name.')]
InfoTopic = Annotated[str | None, typer.Option(
    '--info-topic', metavar='TOPIC', show_default=False,
    help='Topic of the calibration of the colour camera. Default: found by type and name.')]
GroundTruthTopic = Annotated[str | None, typer.Option(
    '--ground-truth-topic', metavar='TOPIC', show_default=False,
    help='Topic of the true poses of the colour camera. Default: found by type and name.')]
RegisterDepth = Annotated[bool, typer.Option(
    '--register-depth',
    help="Depth images of a bag are in their own camera's image: register them to colour.")]
DepthInfoTopic = Annotated[str | None, typer.Option(
    '--depth-info-topic', metavar='TOPIC', show_default=False,
    help='Calibration of the depth camera, with --register-depth.')]
DepthInColour = Annotated[
    tuple[float, float, float, float, float, float, float] | None, typer.Option(
        DEPTH_IN_COLOUR, metavar='X Y Z QX QY QZ QW', show_default=False,
        help='Pose of the depth camera in the colour camera, with --register-depth; without it '
             'from /tf_static of the bag.')]
MaxInterval = Annotated[float, typer.Option(
    '--max-interval', metavar='SECONDS', min=0.0,
    help='Largest difference between the stamps of a colour image and its depth image.')]
Limit = Annotated[int | None, typer.Option(
    '--limit', metavar='N', min=1, show_default=False, help='Stop after N frames.')]

Gaps = Annotated[str, typer.Option(
    '--gaps', metavar='N,N,...', help='Distances, in frames, between the two frames of a pair.')]
JsonFile = Annotated[str | None, typer.Option(
    '--json', metavar='FILE', show_default=False,
    help='Write the results as JSON; - writes them to standard output, and nothing else there.')]


_MOST_GAPS = 100  # chosen
_LARGEST_GAP = 1_000_000  # frames; chosen: nine hours at 30 Hz


def settings_from(preset_name: str | None, config: Path | None,
                  assignments: Sequence[str] | None) -> Settings:
    """
    Return the settings of the options: ``--set`` overrides ``--config`` overrides ``--preset``.

    :raises InputError: naming the option, for an unknown name or an invalid value, and for a plane
        in which the base moves: no recording says how the camera sits on it.
    """
    file = read_settings_file(config) if config is not None else None
    preset_name = preset_name or (file.preset if file is not None else None)
    settings = preset(preset_name) if preset_name else Settings()
    if file is not None:
        settings = file.applied_to(settings)
    changes = dict(map(_assignment, assignments or ()))
    require_of_algorithm('--set', changes)
    settings = with_values(settings, changes)
    if settings.odometry.planar:
        raise InputError('odometry.planar needs the pose of the camera on the robot, which only '
                         'the node knows: add --set odometry.planar=false')
    return settings


def require_of_algorithm(option: str, names: Iterable[str]) -> None:
    """
    Check that an option sets no parameter of the node, which has no effect on recordings.

    :raises InputError: naming it.
    """
    for name in names:
        if name in values(NodeSettings):
            raise InputError(f'{option} {name}: this is a parameter of the node alone and has no '
                             'effect on recordings: omit it')


def gaps_from(gaps: str) -> list[int]:
    """
    Return the gaps of ``--gaps``, sorted.

    :raises InputError: where they are not whole numbers of at least 1.
    """
    try:
        numbers = sorted({int(gap) for gap in gaps.split(',')})
    except ValueError:
        numbers = [0]
    if numbers[0] < 1 or numbers[-1] > _LARGEST_GAP or len(numbers) > _MOST_GAPS:
        raise InputError(f'--gaps {gaps[:80]}: at most {_MOST_GAPS} whole numbers from 1 to '
                         f'{_LARGEST_GAP} are required, for example --gaps 1,5,10')
    return numbers


def bytes_from(option: str, text: str) -> int:
    """
    Return the number of bytes that the value of an option says, for example 50GB.

    :raises InputError: where it says none.
    """
    check_dask()
    from dask.utils import parse_bytes
    try:
        count = int(parse_bytes(text))
        if count < 0 or not text.strip():  # which Dask reads as one byte
            raise ValueError
        return count
    except (ValueError, OverflowError):
        raise InputError(f'{option} {text} is no number of bytes: try 50GB') from None


def _assignment(text: str) -> tuple[str, str]:
    name, equals, value = text.partition('=')
    if not equals:
        raise InputError(f'--set {text}: NAME=VALUE is required, for example --set aick.alpha=0.7')
    return name.strip(), value.strip()
