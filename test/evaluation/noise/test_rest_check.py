# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is rest for a gyroscope and for an accelerometer, and what is not."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.noise.rest_check import check_rest
from aick_ros.sources.synthetic.imu import GRAVITY, IMU_MODELS

INTERVAL = 0.02
TIMES = INTERVAL * np.arange(3000)
UP = GRAVITY * np.array([0.0, -np.cos(0.5), np.sin(0.5)])
MODELS = [IMU_MODELS[name] for name in ('bmi055', 'bmi085', 'icm42688')]


def at_rest(name, model, seed=0):
    noise = getattr(model, name)
    exact = np.tile(UP if name == 'accelerometer' else np.zeros(3), (len(TIMES), 1))
    return noise.measure(exact, INTERVAL, np.random.default_rng(seed))


@pytest.mark.parametrize('model', MODELS)
@pytest.mark.parametrize('name', ['gyroscope', 'accelerometer'])
def test_the_noise_of_known_sensors_is_rest(name, model):
    for seed in range(5):
        check_rest('a recording', name, at_rest(name, model, seed), INTERVAL)


def test_drift_by_temperature_is_rest():
    warming = 0.001 * (1 - np.exp(-TIMES / 20))[:, None]  # rad/s, a sensor after power-on
    check_rest('a recording', 'gyroscope', at_rest('gyroscope', MODELS[0]) + warming, INTERVAL)


def test_resolution_is_rest():
    values = np.tile(UP, (len(TIMES), 1))
    values[1000:, 0] += 0.004
    check_rest('a recording', 'accelerometer', values, INTERVAL)


@pytest.mark.parametrize('name, motion, sentence', [
    ('gyroscope', 0.02 * np.sin(2 * TIMES), 'from one second to the next'),
    ('gyroscope', np.full(len(TIMES), 0.5), 'its mean is 0.5'),
    ('gyroscope', 0.2 * (np.abs(TIMES - 30.5) < 0.1), '3[01] s after the start'),
    ('accelerometer', 0.3 * np.sin(TIMES), 'from one second to the next'),
    ('accelerometer', 0.3 * (TIMES > 40.5), '4[01] s after the start'),
    ('accelerometer', np.full(len(TIMES), 9.0), 'its mean is'),
])
def test_what_moves_is_named(name, motion, sentence):
    values = at_rest(name, MODELS[0])
    values[:, 0] += motion
    with pytest.raises(InputError, match=f'^a recording: the {name} is not at rest, .*{sentence}'):
        check_rest('a recording', name, values, INTERVAL)


def exactly(name, kind, size):
    """Return a minute of values that change, step or deviate by a size, without noise."""
    values = np.tile(UP if name == 'accelerometer' and kind != 'value' else np.zeros(3),
                     (len(TIMES), 1))
    number = np.arange(len(TIMES)) // 50  # of the second
    values[:, 0] += size * {'value': np.ones(len(TIMES)), 'change': number % 2,
                            'step': number >= 40}[kind]
    return values


@pytest.mark.parametrize('name, kind, limit, sentence', [
    ('gyroscope', 'value', 0.2, 'its mean is 0.204 rad/s:'),
    ('gyroscope', 'change', 0.005, 'changes by 0.0051 rad/s from one second to the next'),
    ('gyroscope', 'step', 0.0005, r'changes by 0.00051 rad/s 40 s after the start'),
    ('accelerometer', 'value', 12.0, r'its mean is 12.2 m/s\^2:'),
    ('accelerometer', 'change', 0.1, r'changes by 0.102 m/s\^2 from one second to the next'),
    ('accelerometer', 'step', 0.005, r'changes by 0.0051 m/s\^2 40 s after the start')])
def test_the_limits_of_rest(name, kind, limit, sentence):
    check_rest('a recording', name, exactly(name, kind, 0.98 * limit), INTERVAL)
    with pytest.raises(InputError, match=sentence):
        check_rest('a recording', name, exactly(name, kind, 1.02 * limit), INTERVAL)


@pytest.mark.parametrize('factor, is_rest', [(9.8, True), (10.2, False)])
def test_a_step_is_measured_by_the_usual_changes(factor, is_rest):
    usual = 0.001
    values = exactly('gyroscope', 'change', usual)
    values[1000:, 1] += np.sqrt(factor ** 2 - 1) * usual  # beside the usual one at that second
    if is_rest:
        check_rest('a recording', 'gyroscope', values, INTERVAL)
    else:
        with pytest.raises(InputError, match='changes by 0.0102 rad/s 20 s after the start'):
            check_rest('a recording', 'gyroscope', values, INTERVAL)
