# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The noise of an IMU on the terminal: a parameter file, a table, JSON, a plot."""

import json

import cv2
import numpy as np
import pytest

from aick_ros.cli.commands import noise as noise_module
from aick_ros.cli.input.settings_file import read_settings_file
from aick_ros.frames.imu import ImuSamples
from aick_ros.settings import Settings

GYROSCOPE, ACCELEROMETER = 0.0002, 0.003  # noise densities


@pytest.fixture
def samples():
    """Return 40 s at 50 Hz, at rest."""
    rng, count = np.random.default_rng(0), 2001
    force = rng.normal(0.0, ACCELEROMETER * np.sqrt(50), (count, 3))
    return ImuSamples(20_000_000 * np.arange(count),
                      rng.normal(0.0, GYROSCOPE * np.sqrt(50), (count, 3)),
                      force + [0.0, -9.8, 0.0])


@pytest.fixture
def noise(aick, monkeypatch, samples):
    """Return a function that estimates the noise of the samples."""
    monkeypatch.setattr(noise_module, 'read_imu', lambda path, topic: samples)
    return lambda *arguments: aick('noise', 'desk', '--imu', *arguments)


def test_the_output_is_a_parameter_file(noise, tmp_path):
    outcome = noise('--json', tmp_path / 'noise.json', '--set', 'imu.gyroscope_bias_walk=7.123e-5')
    assert outcome.code == 0
    file = tmp_path / 'imu.yaml'
    file.write_text(outcome.out[outcome.out.index('/**:'):])
    found = read_settings_file(file).applied_to(Settings()).imu
    assert found.gyroscope_noise == pytest.approx(GYROSCOPE, rel=0.05)
    assert found.accelerometer_noise == pytest.approx(ACCELEROMETER, rel=0.05)
    assert found.gyroscope_bias_walk == 7.123e-5
    assert outcome.out.count('# kept, not measured') == 2
    figures = json.loads((tmp_path / 'noise.json').read_text())
    assert figures['gyroscope']['noise'] == pytest.approx(found.gyroscope_noise, rel=1e-3)
    assert figures['gyroscope']['bias_walk'] is None
    assert (figures['source'], figures['duration']) == ('desk', 40.0)


def test_a_recording_has_the_name_of_its_folder(aick, noise, tmp_path, monkeypatch):
    (tmp_path / 'desk').mkdir()
    monkeypatch.chdir(tmp_path / 'desk')
    assert json.loads(aick('noise', '.', '--imu', '--json', '-').out)['source'] == 'desk'


def test_a_walk_that_is_not_determined_is_reported(noise):
    lines = noise().err.splitlines()
    assert len(lines) == 2
    assert '40 s do not show how the bias of the gyroscope walks' in lines[0]
    assert 'of the accelerometer walks' in lines[1]


def test_the_table_has_the_deviations_of_the_json(noise):
    outcome = noise('--json', '-')
    figures = json.loads(outcome.out)
    rows = [line.split() for line in outcome.err.splitlines()]
    for sensor in ('gyroscope', 'accelerometer'):
        allan = figures[sensor]['allan']
        for time, deviations in zip(allan['time'], allan['deviation']):
            shown = [f'{time:.3g}', *(f'{deviation:.2e}' for deviation in deviations)]
            assert shown in [row[:4] for row in rows]


def test_the_plot_is_written(noise, tmp_path):
    assert noise('--plots', tmp_path / 'plots').code == 0
    assert cv2.imread(str(tmp_path / 'plots' / 'allan.png')).std() > 10


@pytest.mark.parametrize('printing, target', [('show_imu_noise', 'a.json'), ('write_json', '-')])
def test_the_plot_is_written_where_nobody_reads_the_figures(
        noise, tmp_path, monkeypatch, printing, target):
    def closed(*given, **named):
        raise BrokenPipeError
    monkeypatch.setattr(noise_module, printing, closed)
    assert noise('--plots', tmp_path / 'plots', '--json', target).code == 141
    assert (tmp_path / 'plots' / 'allan.png').is_file()


def test_a_plot_that_cannot_be_written_is_named(noise, tmp_path):
    (tmp_path / 'plots' / 'allan.png').mkdir(parents=True)
    outcome = noise('--plots', tmp_path / 'plots')
    assert outcome.code == 2
    assert 'cannot write' in outcome.err
    assert '/**:' in outcome.out  # the figures are not lost


def test_motion_is_unusable_input(noise, samples):
    samples.turn_rates[500:600] += 0.5
    outcome = noise()
    assert outcome.code == 2
    assert outcome.sentence.startswith('desk: the gyroscope is not at rest')
    assert outcome.out == ''


@pytest.mark.parametrize('arguments, sentence', [
    (('--imu', '--colour-topic', '/a'), '--colour-topic has no effect on the noise of an IMU'),
    (('--imu', '--limit', '5'), '--limit and --max-interval have no effect'),
    (('--imu', '--max-interval', '0.5'), '--limit and --max-interval have no effect'),
    (('--plots', 'p'), 'have no effect without --imu'),
    (('--imu-topic', '/imu'), 'have no effect without --imu')])
def test_options_without_effect_are_rejected(aick, arguments, sentence):
    outcome = aick('noise', 'desk', *arguments)
    assert outcome.code == 2
    assert sentence in outcome.sentence
