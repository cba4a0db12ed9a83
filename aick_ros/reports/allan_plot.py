# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Allan deviation of gyroscope and accelerometer, with the model fitted to it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from aick_ros.evaluation.noise.imu_noise import ImuNoise, SensorNoise
from aick_ros.reports import canvas

_UNITS = {'gyroscope': 'deg/s', 'accelerometer': 'm/s^2'}
_SCALES = {'gyroscope': float(np.degrees(1.0)), 'accelerometer': 1.0}


def allan_figure(found: ImuNoise) -> Figure:
    """Return a figure with a panel for each sensor that has measured."""
    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, len(found.sensors), squeeze=False)[0]
        for axes, (name, sensor) in zip(panels, found.sensors.items()):
            _draw(axes, sensor, _SCALES[name])
            axes.set(title=f'{found.source}: {name}', xlabel='averaging time [s]',
                     ylabel=f'Allan deviation [{_UNITS[name]}]')
            axes.legend(loc='lower left')

    return canvas.figure(6.0 * len(found.sensors), 4.4, draw)


def _draw(axes: Axes, sensor: SensorNoise, scale: float) -> None:
    """Draw the deviation of each axis with its standard deviation, and the model."""
    allan = sensor.allan
    axes.set(xscale='log', yscale='log')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, position: f'{value:g}'))
        axis.set_minor_formatter(NullFormatter())
    for name, colour, variances in zip('xyz', canvas.SERIES, allan.variances.T):
        deviations = scale * np.sqrt(variances)
        axes.errorbar(allan.times, deviations, 0.5 * allan.relative_errors * deviations,
                      color=colour, marker='o', markersize=3, linewidth=1.0, label=name)
    axes.plot(allan.times, scale * np.sqrt(sensor.densities.at(allan.times)),
              color=canvas.INK, linestyle='--', linewidth=1.4, label='model')
