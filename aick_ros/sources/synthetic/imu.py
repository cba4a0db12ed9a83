# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""
Samples of an IMU at the place of the colour camera, with the noise of known models.

Noise density, offset, range and resolution are those of the data sheets (typical values). The
sheets do not say how fast the offset changes: the random walk of the bias is chosen, such that it
changes by a tenth of the noise density in 100 s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from aick_ros.errors import InputError
from aick_ros.frames.imu import ImuSamples
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s^2]; by definition."""

_WALK = 0.01  # by the noise density; chosen, see above
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class SensorNoise:
    """
    Errors of three axes, in the unit of their values and seconds.

    :param density: of the white noise [unit/sqrt(Hz)].
    :param offset: standard deviation of the bias at the start [unit].
    :param largest: range: larger values saturate [unit].
    :param step: resolution [unit]; 0: exact.
    """

    density: float
    offset: float
    largest: float
    step: float

    def measure(self, values: np.ndarray, interval: float,
                rng: np.random.Generator) -> np.ndarray:
        """
        Return what is measured of Nx3 exact values.

        :param interval: between the samples [s].
        """
        noise = self.density / np.sqrt(interval) * rng.standard_normal(values.shape)
        walk = _WALK * self.density * np.sqrt(interval) * rng.standard_normal(values.shape)
        bias = self.offset * rng.standard_normal(3) + np.cumsum(walk, axis=0)
        measured: np.ndarray = np.clip(values + noise + bias, -self.largest, self.largest)
        if self.step:
            measured = np.rint(measured / self.step) * self.step
        return measured


@dataclass(frozen=True)
class ImuModel:
    """
    An IMU.

    :param gyroscope: errors of the turn rates [rad/s].
    :param accelerometer: errors of the specific force [m/s^2].
    :param rate: of the samples [Hz].
    """

    gyroscope: SensorNoise
    accelerometer: SensorNoise
    rate: float = 200.0


def _model(gyroscope: tuple[float, float], accelerometer: tuple[float, float],
           bits: tuple[int, int] = (16, 16)) -> ImuModel:
    """
    Return a model with ranges of 2000 deg/s and 4 g.

    :param gyroscope: noise density [mdeg/s/sqrt(Hz)] and offset [deg/s].
    :param accelerometer: noise density [ug/sqrt(Hz)] and offset [mg].
    :param bits: of their values.
    """
    turn, force = np.radians(2000.0), 4 * GRAVITY
    return ImuModel(
        SensorNoise(float(np.radians(1e-3 * gyroscope[0])), float(np.radians(gyroscope[1])),
                    float(turn), float(turn / 2 ** (bits[0] - 1))),
        SensorNoise(1e-6 * GRAVITY * accelerometer[0], 1e-3 * GRAVITY * accelerometer[1],
                    force, force / 2 ** (bits[1] - 1)))


IMU_MODELS = {
    # Bosch Sensortec BST-BMI055-DS000
    'bmi055': _model((14.0, 1.0), (150.0, 70.0), (16, 12)),
    # Bosch Sensortec BST-BMI085-DS001
    'bmi085': _model((14.0, 1.0), (120.0, 20.0)),
    # TDK InvenSense DS-000347, ICM-42688-P
    'icm42688': _model((2.8, 0.5), (70.0, 20.0)),
    'perfect': ImuModel(SensorNoise(0.0, 0.0, np.inf, 0.0), SensorNoise(0.0, 0.0, np.inf, 0.0)),
}
"""Name -> model."""


def imu_samples(pose: Callable[[int], np.ndarray], start: int, end: int, model: ImuModel,
                rng: np.random.Generator) -> ImuSamples:
    """
    Return the samples from one stamp to another [ns], in the axes of the camera.

    Each is the mean over its interval, with the stamp in the middle.

    :param pose: stamp -> ``T_world_camera``, 4x4, of a world with z up.
    """
    if end <= start:
        raise InputError('samples of an IMU end after they start')
    period = NANOSECONDS / model.rate
    count = int(np.ceil((end - start) / period)) + 1
    stamps = start + np.rint(period * np.arange(count)).astype(np.int64)
    edges = np.rint(period * (np.arange(count + 1) - 0.5)).astype(np.int64) + start
    poses = np.array([pose(int(stamp)) for stamp in edges])
    interval = 1.0 / model.rate
    rates = np.array([se3.log_rotation(first[:3, :3].T @ second[:3, :3])
                      for first, second in zip(poses, poses[1:])]) / interval
    centres = np.array([pose(int(stamp)) for stamp in stamps])
    forces = _acceleration(poses, centres, interval) + GRAVITY * _UP
    seen = np.einsum('nji,nj->ni', centres[:, :3, :3], forces)
    return ImuSamples(stamps, model.gyroscope.measure(rates, interval, rng),
                      model.accelerometer.measure(seen, interval, rng))


def _acceleration(edges: np.ndarray, centres: np.ndarray, interval: float) -> np.ndarray:
    """Return the mean acceleration between the edges of intervals, Nx3, by second differences."""
    positions = edges[:, :3, 3]
    acceleration: np.ndarray = (positions[1:] - 2 * centres[:, :3, 3] + positions[:-1]) / (
        interval / 2) ** 2
    return acceleration
