# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Output of ``aick noise --imu``: table, parameter file, plot."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from aick_ros.borders.replacement import unwritable
from aick_ros.cli.output.console import line, say, table
from aick_ros.evaluation.noise.allan_fit import Estimate
from aick_ros.evaluation.noise.imu_noise import ImuNoise, SensorNoise
from aick_ros.frames.imu import UNITS
from aick_ros.settings import ImuSettings
from aick_ros.settings.parameter import Parameter, parameters
from aick_ros.settings.text import scalar_text


def show_imu_noise(found: ImuNoise, settings: ImuSettings, on_stderr: bool) -> None:
    """
    Print tables and a parameter file, and what the recording does not determine.

    :param settings: whose values are kept then.
    """
    for name, sensor in found.sensors.items():
        table(f'Allan deviation of the {name} [{UNITS[name]}]', _rows(sensor),
              ('time\n[s]', 'x', 'y', 'z', 'model'), on_stderr)
        line('', on_stderr)
    line('\n'.join(_lines(found, settings)), on_stderr)
    for name, sensor in found.sensors.items():
        walk = sensor.densities.bias_walk
        if walk.value is None:
            say(f'{found.duration:.0f} s do not show how the bias of the {name} walks, which is '
                f'by less than {walk.high:.2g} {UNITS[name]}/s/sqrt(Hz): record for longer')


def write_allan_plot(folder: Path, found: ImuNoise) -> None:
    """
    Draw allan.png into a folder.

    :raises InputError: where it cannot be written.
    """
    from aick_ros.reports import canvas
    from aick_ros.reports.allan_plot import allan_figure
    try:
        canvas.write_png(allan_figure(found), folder / 'allan.png')
    except OSError as error:
        raise unwritable(error.filename or folder, error) from None


def _rows(sensor: SensorNoise) -> Iterator[tuple[str, ...]]:
    model = np.sqrt(sensor.densities.at(sensor.allan.times))
    for time, axes, modelled in zip(sensor.allan.times, np.sqrt(sensor.allan.variances), model):
        yield (f'{time:.3g}', *(f'{axis:.2e}' for axis in axes), f'{modelled:.2e}')


def _lines(found: ImuNoise, settings: ImuSettings) -> Iterator[str]:
    """Yield the lines of a parameter file for the node and ``--config``."""
    declared = {known.name: known for known in parameters(settings)}
    yield '/**:'
    yield '  ros__parameters:'
    yield f'    # measured with aick noise --imu: {found.source}, {found.duration:.0f} s'
    for name, sensor in found.sensors.items():
        yield f'    # {name} at {sensor.rate:.1f} Hz'
        yield _parameter(declared[f'{name}_noise'], sensor.densities.noise)
        yield _parameter(declared[f'{name}_bias_walk'], sensor.densities.bias_walk)


def _parameter(declared: Parameter, estimate: Estimate) -> str:
    if estimate.value is None:
        return f'    imu.{declared.name}: {scalar_text(declared.default)}  # kept, not measured'
    return (f'    imu.{declared.name}: {scalar_text(float(format(estimate.value, ".4g")))}'
            f'  # {estimate.low:.4g} to {estimate.high:.4g}')
