# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Samples of a rendered IMU against the exact path, and their noise against its definition."""

import dataclasses

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.sources.synthetic.imu import GRAVITY, IMU_MODELS, imu_samples

START, SECONDS = 7 * NANOSECONDS, 2
SPIN = np.array([0.5, -0.3, 0.8])  # rad/s, in the axes of the camera
TILTED = se3.exp_rotation((0.4, -1.2, 0.3))
PUSH = np.array([0.3, -0.5, 1.0])  # m/s^2, in the world


def thrown(stamp):
    """Return the pose of a camera that spins and accelerates evenly."""
    time = (stamp - START) / NANOSECONDS
    pose = np.eye(4)
    pose[:3, :3] = TILTED @ se3.exp_rotation(time * SPIN)
    pose[:3, 3] = 0.5 * PUSH * time ** 2 + [1, 2, 3]
    return pose


def samples(model, pose=thrown, seconds=SECONDS, seed=1):
    return imu_samples(pose, START, START + seconds * NANOSECONDS, model,
                       np.random.default_rng(seed))


def test_a_perfect_one_measures_spin_and_push_and_gravity():
    found = samples(IMU_MODELS['perfect'])
    assert np.diff(found.stamps) == pytest.approx(NANOSECONDS / 200, abs=1)
    assert found.stamps[0] == START and found.stamps[-1] >= START + SECONDS * NANOSECONDS
    assert np.allclose(found.turn_rates, SPIN, atol=1e-9)
    for stamp, force in zip(found.stamps, found.accelerations):
        R = thrown(stamp)[:3, :3]
        assert np.allclose(force, R.T @ (PUSH + [0, 0, GRAVITY]), atol=1e-4)


def test_at_rest_the_noise_has_its_density():
    model = IMU_MODELS['bmi055']
    white = dataclasses.replace(
        model, gyroscope=dataclasses.replace(model.gyroscope, step=0.0, offset=0.0),
        accelerometer=dataclasses.replace(model.accelerometer, step=0.0, offset=0.0))
    found = samples(white, lambda stamp: np.eye(4), seconds=5)
    # by definition of a density: averages over a second have its size
    for values, sensor in ((found.turn_rates, white.gyroscope),
                           (found.accelerations, white.accelerometer)):
        assert np.std(np.diff(values, axis=0)) / np.sqrt(2 * white.rate) == pytest.approx(
            sensor.density, rel=0.06)
    assert np.mean(found.accelerations, axis=0) == pytest.approx([0, 0, GRAVITY], abs=0.01)


@pytest.mark.parametrize('name, density, offset', [
    ('bmi055', 0.014, 1.0), ('bmi085', 0.014, 1.0), ('icm42688', 0.0028, 0.5)])
def test_models_have_the_numbers_of_their_data_sheets(name, density, offset):
    gyroscope = IMU_MODELS[name].gyroscope
    assert np.degrees([gyroscope.density, gyroscope.offset]) == pytest.approx([density, offset])


def test_values_beyond_the_range_saturate_and_have_steps():
    model = IMU_MODELS['bmi055']
    fast = dataclasses.replace(model, gyroscope=dataclasses.replace(
        model.gyroscope, largest=0.6, density=0.0, offset=0.0))
    rates = samples(fast).turn_rates
    step = model.gyroscope.step
    assert rates[0] == pytest.approx([0.5, -0.3, 0.6], abs=step)
    assert np.allclose(rates / step, np.rint(rates / step), atol=1e-6)
