# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What is printed of a noise that is known: tables, limits, a parameter file."""

import re

import numpy as np
import pytest
import yaml

from aick_ros.cli.output.imu_noise import show_imu_noise, write_allan_plot
from aick_ros.errors import InputError
from aick_ros.evaluation.noise.allan_fit import Estimate, NoiseDensities
from aick_ros.evaluation.noise.allan_variance import AllanVariance
from aick_ros.evaluation.noise.imu_noise import ImuNoise, SensorNoise
from aick_ros.settings import ImuSettings

TIMES = np.array([0.02, 0.04, 12.8])
VARIANCES = np.array([[1e-4, 4e-4, 9e-4], [1e-6, 4e-6, 9e-6], [1e-8, 4e-8, 9e-8]])


def sensor(noise, walk, rate=50.0):
    return SensorNoise(rate, np.zeros(3), AllanVariance(TIMES, VARIANCES, np.full(3, 10.0)),
                       NoiseDensities(noise, walk))


@pytest.fixture
def found():
    """Return a gyroscope whose walk is not determined and an accelerometer all of which is."""
    return ImuNoise('desk', 59.6,
                    sensor(Estimate(0.00123456, 0.001, 0.002), Estimate(None, 0.0, 0.000345)),
                    sensor(Estimate(0.03, 0.02, 0.04), Estimate(0.006, 0.005, 0.0071), 200.0))


def test_the_table_has_each_axis_and_the_model(found, capfd):
    show_imu_noise(found, ImuSettings(), on_stderr=False)
    tables = capfd.readouterr().out.split('/**:')[0].split('Allan deviation of the ')[1:]
    assert [table.splitlines()[0].strip() for table in tables] == [
        'gyroscope [rad/s]', 'accelerometer [m/s^2]']
    for table in tables:
        assert table.splitlines()[2].split() == ['[s]', 'x', 'y', 'z', 'model']
        assert table.splitlines()[1].split() == ['time']
    for table, (noise, walk) in zip(tables, [(0.00123456, 0.0), (0.03, 0.006)]):
        rows = [list(map(float, row.split())) for row in table.splitlines()
                if re.match(r'[0-9]', row)]
        model = np.sqrt(noise ** 2 / TIMES + walk ** 2 * TIMES / 3)
        np.testing.assert_allclose(
            rows, np.column_stack([TIMES, np.sqrt(VARIANCES), model]), rtol=0.006)


def test_the_parameter_file_has_the_values_and_keeps_what_is_not_known(found, capfd):
    show_imu_noise(found, ImuSettings(gyroscope_bias_walk=7.5e-5), on_stderr=False)
    text = capfd.readouterr().out
    text = text[text.index('/**:'):]
    assert yaml.safe_load(text)['/**']['ros__parameters'] == {
        'imu.gyroscope_noise': 0.001235, 'imu.gyroscope_bias_walk': 7.5e-5,
        'imu.accelerometer_noise': 0.03, 'imu.accelerometer_bias_walk': 0.006}
    comments = [line.partition('#')[2].strip() for line in text.splitlines() if '#' in line]
    assert comments == [
        'measured with aick noise --imu: desk, 60 s', 'gyroscope at 50.0 Hz', '0.001 to 0.002',
        'kept, not measured', 'accelerometer at 200.0 Hz', '0.02 to 0.04', '0.005 to 0.0071']


@pytest.mark.parametrize('on_stderr', [False, True])
def test_the_limit_of_a_walk_that_is_not_known_is_said(found, capfd, on_stderr):
    show_imu_noise(found, ImuSettings(), on_stderr)
    out, err = capfd.readouterr()
    said = [line for line in err.splitlines() if line.startswith('aick: ')]
    assert said == ['aick: 60 s do not show how the bias of the gyroscope walks, which is by less '
                    'than 0.00034 rad/s/s/sqrt(Hz): record for longer']
    assert ('/**:' in err, '/**:' in out) == (on_stderr, not on_stderr)
    assert ('Allan deviation' in err, out == '') == (on_stderr, on_stderr)


def test_a_sensor_that_has_not_measured_is_not_in_the_file(found, capfd):
    show_imu_noise(ImuNoise('desk', 59.6, None, found.accelerometer), ImuSettings(), False)
    out, err = capfd.readouterr()
    assert 'gyroscope' not in out + err
    assert 'imu.accelerometer_bias_walk: 0.006' in out


def test_a_plot_that_cannot_be_written_is_named(found, tmp_path):
    write_allan_plot(tmp_path, found)
    assert [path.name for path in tmp_path.iterdir()] == ['allan.png']
    with pytest.raises(InputError, match=f'^cannot write .*{tmp_path.name}/none/'):
        write_allan_plot(tmp_path / 'none', found)
