# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""``aick noise``: the noise model of a camera that nobody has characterised."""

from __future__ import annotations

from collections.abc import Iterator

import typer

from aick_ros.cli import options, outcome
from aick_ros.cli.console import figure, progress, say, table
from aick_ros.cli.files import STANDARD_OUTPUT, check_target, write_json
from aick_ros.cli.reading import Reading
from aick_ros.evaluation.depth_noise import DepthNoise, estimate_depth_noise
from aick_ros.sources import SourceOptions, open_source


def noise(source: options.Source, json: options.JsonFile = None, config: options.Config = None,
          assignments: options.Assignments = None, camera: options.CameraFile = None,
          colour_topic: options.ColourTopic = None, depth_topic: options.DepthTopic = None,
          info_topic: options.InfoTopic = None,
          ground_truth_topic: options.GroundTruthTopic = None,
          max_interval: options.MaxInterval = SourceOptions.max_interval,
          limit: options.Limit = None) -> int:
    """
    Estimate the depth noise of a camera, as the lines to put into the file of parameters.

    Record walls, floors and tables, from near and from far. It uses sensor.min_depth and
    sensor.max_depth, and sensor.depth_exponent where the recording does not tell it.
    """
    sensor = options.settings_from(None, config, assignments).sensor
    if json is not None:
        check_target(json)
    recording = open_source(source, SourceOptions(
        camera, colour_topic, depth_topic, info_topic, ground_truth_topic, max_interval))
    with Reading(recording, limit) as reading, progress(reading.name, len(reading)) as show:
        found = estimate_depth_noise(reading, sensor, show, reading.damage)
    if json is not None:
        write_json(json, {**found.to_json(), 'ended': reading.ended,
                          'damaged_images': reading.damage.count})
    _show(found, on_stderr=json == STANDARD_OUTPUT)
    if not found.exponent_estimated:
        say(_why_kept(found))
    return outcome.of_reading(reading)


def _show(found: DepthNoise, on_stderr: bool) -> None:
    table('depth noise', (
        (figure(bin_.depth, digits=2), str(bin_.patches), figure(1e3 * bin_.sigma, digits=2),
         figure(1e3 * bin_.model, digits=2)) for bin_ in found.bins),
        ('depth\n[m]', 'patches', 'sigma\n[mm]', 'model\n[mm]'), on_stderr)
    typer.echo('\n' + '\n'.join(_lines(found)), err=on_stderr)


def _lines(found: DepthNoise) -> Iterator[str]:
    """Yield a file of parameters for the node and ``--config``."""
    yield '/**:'
    yield '  ros__parameters:'
    yield f'    # measured with aick noise: {found.source}, {found.frames} frames'
    yield f'    # depths from {found.nearest:.2f} to {found.farthest:.2f} m, {_surfaces(found)}'
    yield f'    sensor.depth_sigma: {found.depth_sigma:.5f}'
    kept = '' if found.exponent_estimated else '  # kept, not measured'
    yield f'    sensor.depth_exponent: {found.depth_exponent:.2f}{kept}'


def _why_kept(found: DepthNoise) -> str:
    return (f'{_surfaces(found)} only: too little to tell how the noise grows with the depth, so '
            f'the exponent is kept at {found.depth_exponent:g}. 2 is right for structured light '
            'and stereo; for time of flight record from near and from far, or give --set '
            'sensor.depth_exponent=0 (to 1)')


def _surfaces(found: DepthNoise) -> str:
    return f'smooth surfaces from {found.bins[0].depth:.2f} to {found.bins[-1].depth:.2f} m'
