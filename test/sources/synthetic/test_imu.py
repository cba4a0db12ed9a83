# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Samples of a rendered IMU against the exact path, and their noise against its definition."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.stamps import NANOSECONDS
from aick_ros.sources.synthetic.imu import GRAVITY, IMU_MODELS, SensorNoise, imu_samples

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


@pytest.mark.parametrize('name, density, offset, bits', [
    ('bmi055', 150e-6, 70e-3, 12), ('bmi085', 120e-6, 20e-3, 16), ('icm42688', 70e-6, 20e-3, 16)])
def test_accelerometers_have_those_of_theirs_too(name, density, offset, bits):
    """In g; both sensors have a range to either side that their bits divide."""
    model = IMU_MODELS[name]
    sensor = model.accelerometer
    assert np.array([sensor.density, sensor.offset, sensor.largest]) / GRAVITY == pytest.approx(
        [density, offset, 4.0])
    assert 2 * sensor.largest / sensor.step == pytest.approx(2 ** bits)
    assert np.degrees(model.gyroscope.largest) == pytest.approx(2000.0)
    assert 2 * model.gyroscope.largest / model.gyroscope.step == pytest.approx(2 ** 16)
    assert model.rate == 200.0


def test_the_bias_starts_anywhere_within_its_offset():
    rng = np.random.default_rng(4)
    sensor = SensorNoise(0.0, 0.3, np.inf, 0.0)
    found = np.array([sensor.measure(np.zeros((5, 3)), 0.25, rng) for _ in range(4000)])
    assert (found == found[:, :1]).all()
    assert found[:, 0].std(axis=0) == pytest.approx([0.3] * 3, rel=0.05)
    assert abs(np.corrcoef(found[:, 0].T)[0, 1]) < 0.06


def test_the_bias_walks_by_a_tenth_of_the_density_in_a_hundred_seconds():
    """Means of the halves of a walk of variance s^2 T differ by s^2 T / 3."""
    rng, interval, seconds = np.random.default_rng(5), 25.0, 10_000.0
    sensor = SensorNoise(2.0, 0.0, np.inf, 0.0)
    found = np.array([sensor.measure(np.zeros((400, 3)), interval, rng) for _ in range(1000)])
    moved = found[:, 200:].mean(axis=1) - found[:, :200].mean(axis=1)
    white, walk = 2 * 2.0 ** 2 / (seconds / 2), (0.1 * 2.0) ** 2 / 100.0 * seconds / 3
    assert moved.var() == pytest.approx(white + walk, rel=0.1)


def test_offsets_reach_the_samples_of_their_sensor():
    quiet = IMU_MODELS['perfect']
    biased = dataclasses.replace(quiet, accelerometer=dataclasses.replace(
        quiet.accelerometer, offset=0.5))
    exact, found = samples(quiet), samples(biased)
    np.testing.assert_array_equal(found.turn_rates, exact.turn_rates)
    wrong = found.accelerations - exact.accelerations
    assert np.allclose(wrong, wrong[0]) and 0.05 < np.linalg.norm(wrong[0]) < 3.0


@pytest.mark.parametrize('seconds', [0, -1])
def test_samples_need_time(seconds):
    with pytest.raises(InputError, match='end after they start'):
        samples(IMU_MODELS['perfect'], seconds=seconds)


def test_the_last_sample_is_the_first_that_is_not_before_the_end():
    model = dataclasses.replace(IMU_MODELS['perfect'], rate=100.0)
    for end, count in ((20_000_000, 3), (20_000_001, 4), (29_999_999, 4)):
        found = imu_samples(thrown, START, START + end, model, np.random.default_rng(0))
        assert len(found.stamps) == count
        assert found.stamps[-2] < START + end <= found.stamps[-1]
