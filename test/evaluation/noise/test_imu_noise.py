# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The noise of known models of IMUs at rest, and recordings that do not show it."""

import dataclasses
import json

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.noise.imu_noise import estimate_imu_noise
from aick_ros.frames.imu import ImuSamples
from aick_ros.sources.synthetic.imu import GRAVITY, IMU_MODELS

RATE = 100.0
BMI085 = IMU_MODELS['bmi085']
UP = np.array([0.0, -GRAVITY, 0.0])


def at_rest(model, duration=60.0, rate=RATE, seed=0):
    """Return samples of a model at rest, not rounded to its resolution."""
    rng, count = np.random.default_rng(seed), round(duration * rate) + 1

    def measured(noise, exact):
        return dataclasses.replace(noise, step=0.0).measure(
            np.tile(exact, (count, 1)), 1 / rate, rng)

    return ImuSamples(10 ** 9 + np.rint(1e9 / rate * np.arange(count)).astype(np.int64),
                      measured(model.gyroscope, np.zeros(3)), measured(model.accelerometer, UP))


@pytest.mark.parametrize('name', ['bmi055', 'bmi085', 'icm42688'])
def test_the_densities_are_those_of_the_model(name):
    """Of 24 intervals of 95 %, fewer than 19 have the truth inside once in 1000."""
    model, hits = IMU_MODELS[name], 0
    for seed in range(12):
        found = estimate_imu_noise('a recording', at_rest(model, seed=seed))
        for sensor, truth in ((found.gyroscope, model.gyroscope),
                              (found.accelerometer, model.accelerometer)):
            noise = sensor.densities.noise
            assert noise.value == pytest.approx(truth.density, rel=0.08)
            hits += noise.low <= truth.density <= noise.high
    assert hits >= 19


def test_the_walk_of_three_hours_is_that_of_the_model():
    samples = at_rest(BMI085, 10800.0, rate=10.0)
    walk = estimate_imu_noise('a recording', samples).gyroscope.densities.bias_walk
    truth = 0.01 * BMI085.gyroscope.density
    assert walk.low <= truth <= walk.high
    assert walk.value == pytest.approx(truth, rel=0.3)


def test_rate_mean_and_duration_are_reported():
    samples = at_rest(BMI085)
    found = estimate_imu_noise('a recording', samples)
    assert found.duration == pytest.approx(60.0)
    assert found.gyroscope.rate == pytest.approx(RATE)
    np.testing.assert_allclose(found.accelerometer.mean, samples.accelerations.mean(axis=0))


def test_the_json_has_each_figure_under_its_name():
    found = estimate_imu_noise('a recording', at_rest(BMI085))
    content = json.loads(json.dumps(found.to_json()))
    assert (content.pop('source'), content.pop('duration')) == ('a recording', found.duration)
    assert list(content) == ['gyroscope', 'accelerometer']
    for name, part in content.items():
        sensor = found.sensors[name]
        noise, walk = sensor.densities.noise, sensor.densities.bias_walk
        assert part == {
            'rate': sensor.rate, 'mean': list(sensor.mean),
            'noise': noise.value, 'noise_95': [noise.low, noise.high],
            'bias_walk': walk.value, 'bias_walk_95': [walk.low, walk.high],
            'allan': {'time': list(sensor.allan.times),
                      'deviation': (sensor.allan.variances ** 0.5).tolist(),
                      'degrees_of_freedom': list(sensor.allan.degrees_of_freedom)}}


def test_stamps_given_in_bursts_do_not_matter():
    samples = at_rest(BMI085)
    bursts = samples.stamps // 50_000_000 * 50_000_000 + np.arange(len(samples)) % 5
    found = estimate_imu_noise('a recording', ImuSamples(
        bursts, samples.turn_rates, samples.accelerations))
    truth = BMI085.gyroscope.density
    assert found.gyroscope.densities.noise.value == pytest.approx(truth, rel=0.05)


@pytest.mark.parametrize('missing', [np.nan, 0.0])
def test_a_sensor_that_does_not_measure_is_omitted(missing):
    samples = at_rest(BMI085)
    without = ImuSamples(samples.stamps, np.full_like(samples.turn_rates, missing),
                         samples.accelerations)
    found = estimate_imu_noise('a recording', without)
    assert list(found.sensors) == ['accelerometer'] == list(found.to_json())[2:]
    nothing = ImuSamples(samples.stamps, without.turn_rates, without.turn_rates)
    with pytest.raises(InputError, match='a recording: neither gyroscope nor accelerometer'):
        estimate_imu_noise('a recording', nothing)


@pytest.mark.parametrize('count', [0, 1, 2500])
def test_one_that_is_too_short_is_rejected(count):
    seconds = 0.0 if count < 2 else 25.0
    with pytest.raises(InputError, match=f'for {seconds:.1f} s: at least 30 s at rest'):
        estimate_imu_noise('a recording', at_rest(BMI085)[:count])


def test_one_with_gaps_is_rejected():
    samples = at_rest(BMI085)
    kept = np.arange(len(samples)) % 1000 > 20  # 0.2 s of 10 s
    with pytest.raises(InputError, match=r'gyroscope: samples are missing for 1\.[0-9] of 59'):
        estimate_imu_noise('a recording', samples[kept])
    kept = np.arange(len(samples)) % 1000 > 2
    assert estimate_imu_noise('a recording', samples[kept]).gyroscope is not None


def test_one_that_moves_is_rejected():
    samples = at_rest(BMI085)
    samples.turn_rates[3000:3050] += 0.3
    with pytest.raises(InputError, match='the gyroscope is not at rest'):
        estimate_imu_noise('a recording', samples)


@pytest.mark.parametrize('scale', [1e-3, 1e-170])
def test_values_that_repeat_are_rejected(scale):
    """Over 0.16 s their means are all the same, or their squares are."""
    samples = at_rest(BMI085)
    alternating = scale * np.where(np.arange(len(samples)) % 2, 1.0, -1.0)
    samples.turn_rates[:] = alternating[:, None]
    with pytest.raises(InputError, match='the gyroscope shows no noise, its values repeat'):
        estimate_imu_noise('a recording', samples)


@pytest.mark.parametrize('missing, is_usable', [(0.55, True), (0.65, False)])
def test_a_hundredth_may_be_missing(missing, is_usable):
    """Of 60 s in one gap."""
    samples = at_rest(BMI085)
    times = (samples.stamps - samples.stamps[0]) / 1e9
    kept = samples[(times < 20.0) | (times > 20.0 + missing)]
    if is_usable:
        assert estimate_imu_noise('a recording', kept).gyroscope is not None
    else:
        with pytest.raises(InputError, match=r'samples are missing for 0\.7 of 60\.0 s'):
            estimate_imu_noise('a recording', kept)


@pytest.mark.parametrize('removed, is_usable', [(9, True), (10, False)])
def test_a_tenth_of_a_second_is_no_gap(removed, is_usable):
    """Of each 100 samples at 100 Hz."""
    samples = at_rest(BMI085)
    kept = samples[np.arange(len(samples)) % 100 >= removed]
    if is_usable:
        assert estimate_imu_noise('a recording', kept).gyroscope is not None
    else:
        with pytest.raises(InputError, match='gyroscope: samples are missing for 6.[0-9] of 5'):
            estimate_imu_noise('a recording', kept)


@pytest.mark.parametrize('duration, is_enough', [(30.0, True), (29.99, False)])
def test_half_a_minute_is_enough(duration, is_enough):
    if is_enough:
        assert estimate_imu_noise('desk', at_rest(BMI085, duration)).duration == duration
    else:
        with pytest.raises(InputError) as error:
            estimate_imu_noise('desk', at_rest(BMI085, duration))
        assert str(error.value) == (
            'desk has samples of an IMU for 30.0 s: at least 30 s at rest are required for its '
            'noise, and an hour or more for the walk of its bias')


def test_a_sensor_that_misses_half_of_the_time_is_rejected():
    """The IMU has samples for a minute, and of its gyroscope for less than half of it."""
    samples = at_rest(BMI085)
    samples.turn_rates[:len(samples) // 2 + 10] = np.nan
    with pytest.raises(InputError, match='^a recording, gyroscope: samples are missing for 0.0 of '
                       '29.9 s: record without gaps$'):
        estimate_imu_noise('a recording', samples)
