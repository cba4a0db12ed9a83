# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Noise of the gyroscope and the accelerometer of an IMU, from a recording at rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aick_ros.errors import InputError
from aick_ros.evaluation.noise.allan_fit import Estimate, NoiseDensities, fit_densities
from aick_ros.evaluation.noise.allan_variance import AllanVariance, allan_variance
from aick_ros.evaluation.noise.rest_check import check_rest
from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry.stamps import NANOSECONDS, seconds

_SHORTEST = 30.0  # s; chosen: the noise density is known to 3 % then
_LONGEST_GAP = NANOSECONDS // 10  # chosen
_LEAST_VARIANCE = 1e-24  # (rad/s)^2, (m/s^2)^2; chosen: far below any sensor's mean over hours
_MOST_MISSING = 0.01  # of the duration; chosen


@dataclass(frozen=True, eq=False)
class SensorNoise:
    """
    Noise of a gyroscope or an accelerometer.

    :param rate: of the samples [Hz].
    :param mean: of the values, 3: the bias, with gravity [unit].
    :param allan: Allan variances of the three axes.
    :param densities: noise and bias walk that these show.
    """

    rate: float
    mean: np.ndarray
    allan: AllanVariance
    densities: NoiseDensities

    def to_json(self) -> dict[str, object]:
        """Return the fields of the JSON."""
        noise, walk = self.densities.noise, self.densities.bias_walk
        return {'rate': self.rate, 'mean': self.mean.tolist(),
                'noise': noise.value, 'noise_95': _interval(noise),
                'bias_walk': walk.value, 'bias_walk_95': _interval(walk),
                'allan': {'time': self.allan.times.tolist(),
                          'deviation': np.sqrt(self.allan.variances).tolist(),
                          'degrees_of_freedom': self.allan.degrees_of_freedom.tolist()}}


@dataclass(frozen=True, eq=False)
class ImuNoise:
    """
    Noise of an IMU.

    :param source: name of the recording.
    :param duration: of the recording [s].
    :param gyroscope: [rad/s]; None where it has not measured.
    :param accelerometer: [m/s^2]; None where it has not measured.
    """

    source: str
    duration: float
    gyroscope: SensorNoise | None
    accelerometer: SensorNoise | None

    @property
    def sensors(self) -> dict[str, SensorNoise]:
        """Those that have measured, by name."""
        both = {'gyroscope': self.gyroscope, 'accelerometer': self.accelerometer}
        return {name: sensor for name, sensor in both.items() if sensor is not None}

    def to_json(self) -> dict[str, object]:
        """Return the content of the JSON."""
        return {'source': self.source, 'duration': self.duration,
                **{name: sensor.to_json() for name, sensor in self.sensors.items()}}


def estimate_imu_noise(source: str, samples: ImuSamples) -> ImuNoise:
    """
    Estimate the noise of an IMU at rest.

    :param source: name of the recording.
    :param samples: in the order of their stamps, which differ.
    :raises InputError: where it is not at rest, or there are too few samples.
    """
    duration = _duration(samples.stamps)
    if duration < _SHORTEST:
        raise InputError(
            f'{source} has samples of an IMU for {duration:.1f} s: at least {_SHORTEST:g} s at '
            'rest are required for its noise, and an hour or more for the walk of its bias')
    gyroscope = _estimate(source, 'gyroscope', samples.stamps, samples.turn_rates)
    accelerometer = _estimate(source, 'accelerometer', samples.stamps, samples.accelerations)
    if gyroscope is None and accelerometer is None:
        raise InputError(f'{source}: neither gyroscope nor accelerometer has measured anything '
                         'but one value')
    return ImuNoise(source, duration, gyroscope, accelerometer)


def _estimate(source: str, name: str, stamps: np.ndarray, values: np.ndarray
              ) -> SensorNoise | None:
    """Return the noise of one sensor; None where it measures nothing, or one value only."""
    measured = np.isfinite(values).all(axis=1)
    stamps, values = stamps[measured], values[measured]
    if not len(values) or not np.ptp(values, axis=0).any():
        return None
    interval = _interval_between(f'{source}, {name}', stamps)
    check_rest(source, name, values, interval)
    allan = allan_variance(values, interval)
    if not (allan.variances.mean(axis=1) > _LEAST_VARIANCE).all():
        raise InputError(f'{source}: the {name} shows no noise, its values repeat: record the '
                         'values that the sensor itself measures')
    return SensorNoise(1.0 / interval, values.mean(axis=0), allan, fit_densities(allan))


def _interval_between(what: str, stamps: np.ndarray) -> float:
    """Return the mean interval between samples [s], of a sensor without long gaps."""
    gaps = np.diff(stamps)
    total = _duration(stamps)
    missing = float(gaps[gaps > _LONGEST_GAP].sum()) / NANOSECONDS
    if total < _SHORTEST or missing > _MOST_MISSING * total:
        raise InputError(f'{what}: samples are missing for {missing:.1f} of {total:.1f} s: record '
                         'without gaps')
    return total / (len(stamps) - 1)


def _duration(stamps: np.ndarray) -> float:
    """Return the time from the first stamp to the last one [s]."""
    return seconds(int(stamps[0]), int(stamps[-1])) if len(stamps) else 0.0


def _interval(estimate: Estimate) -> list[float]:
    return [estimate.low, estimate.high]
