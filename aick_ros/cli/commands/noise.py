# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick noise``: the noise model of an unknown camera, or of an unknown IMU."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from aick_ros.borders.names import counted
from aick_ros.cli import exit_codes, outcome
from aick_ros.cli.input import options
from aick_ros.cli.input.reading import Reading
from aick_ros.cli.output.console import decimal, line, progress, say, table
from aick_ros.cli.output.files import write_json
from aick_ros.cli.output.imu_noise import show_imu_noise, write_allan_plot
from aick_ros.cli.output.plot_folder import make_plot_folder, removed_if_empty
from aick_ros.cli.output.target import STANDARD_OUTPUT, check_target
from aick_ros.errors import InputError
from aick_ros.evaluation.noise.camera_noise import CameraNoise, estimate_noise
from aick_ros.evaluation.noise.depth_noise import DepthNoise
from aick_ros.evaluation.noise.imu_noise import estimate_imu_noise
from aick_ros.evaluation.noise.pixel_noise import MIN_FLOW, MIN_PAIRS, PixelNoise
from aick_ros.registration.refinement.misalignment import Misalignment
from aick_ros.settings import Settings
from aick_ros.settings.parameter import parameters
from aick_ros.sources import BAG_FLAGS, RgbdSource, SourceOptions, open_source, reject
from aick_ros.sources.imu_recording import read_imu

Imu = Annotated[bool, typer.Option(
    '--imu', help='Estimate the noise of the IMU of a bag or TUM folder instead, which was '
    'recorded at rest.')]
ImuTopic = Annotated[str | None, typer.Option(
    '--imu-topic', metavar='TOPIC', show_default=False,
    help='Topic of the IMU in a bag, with --imu. Default: the only one.')]
Plots = Annotated[Path | None, typer.Option(
    '--plots', metavar='DIR', show_default=False,
    help='Folder for the plot of the Allan deviation, allan.png, with --imu.')]


def noise(source: options.Source, json: options.JsonFile = None, config: options.Config = None,
          assignments: options.Assignments = None, camera: options.CameraFile = None,
          colour_topic: options.ColourTopic = None, depth_topic: options.DepthTopic = None,
          info_topic: options.InfoTopic = None,
          ground_truth_topic: options.GroundTruthTopic = None,
          max_interval: options.MaxInterval = SourceOptions.max_interval,
          register_depth: options.RegisterDepth = False,
          depth_info_topic: options.DepthInfoTopic = None,
          depth_in_colour: options.DepthInColour = None,
          limit: options.Limit = None, imu: Imu = False, imu_topic: ImuTopic = None,
          plots: Plots = None) -> int:
    """
    Estimate the noise of a camera or an IMU, and print it as a parameter file.

    Record walls, floors and tables, from near and from far, with the camera moving slowly, and
    move and turn it to and fro in a furnished room for ten seconds: this shows how the two images
    are misaligned, in space and in time. Exponents of the noise and the misalignment are kept
    where the recording does not determine them.

    For an IMU (--imu), leave it on a firm surface: a minute shows its noise, some hours how its
    bias walks.
    """
    settings = options.settings_from(None, config, assignments)
    check_target(json, source, config, camera, *settings.files)
    how = SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval,
        register_depth, depth_info_topic, depth_in_colour)
    if imu:
        reject(how, 'the noise of an IMU', '--camera', *BAG_FLAGS)
        if limit is not None or max_interval != SourceOptions.max_interval:
            raise InputError('--limit and --max-interval have no effect on the noise of an IMU: '
                             'omit them')
        return _noise_of_imu(Path(source), imu_topic, settings, json, plots)
    if imu_topic is not None or plots is not None:
        raise InputError('--imu-topic and --plots have no effect without --imu: omit them')
    return _noise_of_camera(open_source(source, how), settings, json, limit)


def _noise_of_camera(recording: RgbdSource, settings: Settings, json: str | None,
                     limit: int | None) -> int:
    with Reading(recording, limit) as reading, progress(reading.name, len(reading)) as show:
        found = estimate_noise(reading, settings, show, reading.damage)
    if json is not None:
        write_json(json, {**found.to_json(), 'ended': reading.ended,
                          'damaged_images': reading.damage.count})
    _show(found, on_stderr=json == STANDARD_OUTPUT)
    for sentence in _shortcomings(found):
        say(sentence)
    return outcome.of_reading(reading)


def _noise_of_imu(path: Path, topic: str | None, settings: Settings, json: str | None,
                  plots: Path | None) -> int:
    with removed_if_empty(plots):
        if plots is not None:
            make_plot_folder(plots)
        found = estimate_imu_noise(path.resolve().name, read_imu(path, topic))
        try:
            if plots is not None:  # first: where nobody reads the figures, printing them ends
                write_allan_plot(plots, found)
        finally:
            if json is not None:
                write_json(json, found.to_json())
            show_imu_noise(found, settings.imu, on_stderr=json == STANDARD_OUTPUT)
    return exit_codes.DONE


def _show(found: CameraNoise, on_stderr: bool) -> None:
    table('depth noise', (
        (decimal(bin_.depth, digits=2), str(bin_.patches), decimal(1e3 * bin_.sigma, digits=2),
         decimal(1e3 * bin_.model, digits=2)) for bin_ in found.depth.bins),
        ('depth\n[m]', 'patches', 'sigma\n[mm]', 'model\n[mm]'), on_stderr)
    if found.pixels is not None:
        line('', on_stderr)
        table(f'noise of {found.pixels.detector} keypoints', (
            (decimal(bin_.scale, digits=2), str(bin_.matches), decimal(bin_.sigma, digits=2),
             decimal(bin_.model, digits=2)) for bin_ in found.pixels.bins),
            ('scale', 'matches', 'sigma\n[px]', 'model\n[px]'), on_stderr)
    line('\n' + '\n'.join(_lines(found)), on_stderr)


def _lines(found: CameraNoise) -> Iterator[str]:
    """Yield the lines of a parameter file for the node and ``--config``."""
    depth, pixels = found.depth, found.pixels
    yield '/**:'
    yield '  ros__parameters:'
    frames = counted(depth.frames, 'frame')
    yield f'    # measured with aick noise: {depth.source}, {frames}'
    yield f'    # depths from {depth.nearest:.2f} to {depth.farthest:.2f} m, {_surfaces(depth)}'
    yield f'    sensor.depth_sigma: {depth.depth_sigma:.5f}'
    yield f'    sensor.depth_exponent: {depth.depth_exponent:.2f}{_kept(depth)}'
    if pixels is not None:
        yield f'    # {sum(bin_.matches for bin_ in pixels.bins)} keypoints detected in two images'
        yield f'    features.{pixels.detector}.pixel_sigma: {pixels.pixel_sigma:.2f}'
        yield (f'    features.{pixels.detector}.pixel_exponent: {pixels.pixel_exponent:.2f}'
               f'{_kept(pixels)}')
    if (description := Misalignment.by(found.misalignment).description):
        yield from (f'    # {sentence}' for sentence in description.split('; '))
    for known in parameters(found.misalignment):
        if known.default:
            yield f'    misalignment.{known.name}: {known.default:.4f}'
    if not found.distortion.is_none:
        yield f'    # {found.distortion.description}'


def _kept(found: DepthNoise | PixelNoise) -> str:
    return '' if found.exponent_estimated else '  # kept, not measured'


def _shortcomings(found: CameraNoise) -> Iterator[str]:
    """Yield a sentence for each quantity that the recording does not determine."""
    depth, pixels = found.depth, found.pixels
    if not depth.exponent_estimated:
        yield (f'{_surfaces(depth)} only: this range is too small to estimate how the noise grows '
               f'with depth, so sensor.depth_exponent is kept at {depth.depth_exponent:g}. 2 is '
               'right for structured light and stereo; for time of flight, record from near and '
               'from far, or set it to a value from 0 to 1 with --set sensor.depth_exponent=0')
    if pixels is None:
        yield (f'the noise of the keypoints is not estimated: at least {MIN_PAIRS} pairs of '
               f'textured images with a flow of {MIN_FLOW:g} pixels or more are required, there '
               f'are {found.pairs}; record with the camera moving slowly')
    elif not pixels.exponent_estimated:
        yield (f'{pixels.detector} keypoints of about one scale only: '
               f'features.{pixels.detector}.pixel_exponent is kept at {pixels.pixel_exponent:g}')


def _surfaces(found: DepthNoise) -> str:
    return f'smooth surfaces from {found.bins[0].depth:.2f} to {found.bins[-1].depth:.2f} m'
