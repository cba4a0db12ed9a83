# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rendered recordings read back as they were rendered."""

import signal

import numpy as np
import pytest

from aick_ros.cli.commands import simulate as simulate_module
from aick_ros.frames.imu import joined
from aick_ros.geometry.camera import Camera
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.imu import IMU_MODELS

SMALL = ('--size', '160x120', '--frames', '3')
CAMERA = Camera(160, 120, 131.25, 131.25, 79.5, 59.5)


@pytest.fixture(scope='module')
def rendered():
    """Return what the renderer itself renders."""
    return SyntheticSource(SyntheticOptions(seed=4, frames=3, rate=10.0, camera=CAMERA))


@pytest.mark.parametrize('format', ['mcap', 'sqlite3', 'tum'])
def test_writes_what_the_renderer_renders(aick, tmp_path, rendered, format):
    outcome = aick('simulate', 'out', *SMALL, '--seed', '4', '--rate', '10', '--format', format)
    assert (outcome.code, outcome.err) == (0, '')
    assert outcome.out == '3 frames in out\n'
    written = open_source(tmp_path / 'out')
    for frame, expected in zip(written.frames(raise_damage), rendered.frames(raise_damage),
                               strict=True):
        assert (frame.stamp, frame.camera) == (expected.stamp, CAMERA)
        np.testing.assert_array_equal(frame.colour, expected.colour)
        np.testing.assert_allclose(frame.depth, expected.depth, atol=1.1e-4)
    np.testing.assert_allclose(written.ground_truth.poses, rendered.ground_truth.poses,
                               atol=1e-8)


def test_an_imu_is_in_the_bag(aick, tmp_path):
    aick('simulate', 'out', *SMALL, '--seed', '4', '--rate', '10', '--imu', 'BMI055')
    source = SyntheticSource(SyntheticOptions(seed=4, frames=3, rate=10.0, camera=CAMERA,
                                              imu=IMU_MODELS['bmi055']))
    found = joined([frame.imu for frame in open_source(tmp_path / 'out').frames(raise_damage)])
    np.testing.assert_array_equal(found.turn_rates, source.imu.turn_rates[:len(found)])
    np.testing.assert_array_equal(found.accelerations, source.imu.accelerations[:len(found)])
    assert len(source.imu) - len(found) <= 4  # those after the last image


def test_every_imu_can_be_chosen():
    assert [name.value for name in simulate_module.ImuName] == list(IMU_MODELS)


def test_perfect_depth_has_no_holes(aick, tmp_path, rendered):
    aick('simulate', 'perfect', *SMALL, '--seed', '4', '--perfect')
    frames = open_source(tmp_path / 'perfect').frames(raise_damage)
    assert not any(np.isnan(frame.depth).any() for frame in frames)
    assert all(np.isnan(frame.depth).any() for frame in rendered.frames(raise_damage))


@pytest.mark.parametrize('option, value, words', [
    ('--size', '640', '--size 640: WIDTHxHEIGHT'), ('--size', '8x8', 'from 16'),
    ('--size', '-640x480', '--size'), ('--size', '99999x10', 'to 4096'),
    ('--rate', '0', 'rate is 0 Hz'),
    ('--imu', 'mpu6000', '--imu'), ('--frames', '0', '--frames'), ('--seed', '-1', '--seed')])
def test_invalid_options_of_the_renderer_are_rejected(aick, tmp_path, option, value, words):
    outcome = aick('simulate', 'out', f'{option}={value}')
    assert outcome.code == 2
    assert words in outcome.sentence
    assert list(tmp_path.iterdir()) == []


def test_does_not_write_over_anything(aick, tmp_path, monkeypatch, recording):
    monkeypatch.setattr(simulate_module, 'SyntheticSource', lambda options: recording)
    (tmp_path / 'out').mkdir()
    outcome = aick('simulate', 'out', *SMALL)
    assert outcome.code == 2
    assert 'out exists already' in outcome.sentence


@pytest.mark.parametrize('out', ['there', 'loop/out'])
def test_a_place_that_cannot_be_is_rejected_before_the_room_is_built(
        aick, tmp_path, monkeypatch, out):
    (tmp_path / 'there').mkdir()
    (tmp_path / 'loop').symlink_to('loop')
    monkeypatch.setattr(simulate_module, 'SyntheticSource',
                        lambda options: pytest.fail('it is built'))
    outcome = aick('simulate', out, *SMALL)
    assert outcome.code == 2
    assert out in outcome.sentence


@pytest.mark.parametrize('format', ['mcap', 'tum'])
def test_interrupted_it_leaves_nothing(aick, tmp_path, monkeypatch, recording, in_memory, format):
    def interrupt(index, on_damaged):
        if index == 1:
            signal.raise_signal(signal.SIGINT)

    source = in_memory(list(recording.frames(raise_damage)), on_frame=interrupt)
    monkeypatch.setattr(simulate_module, 'SyntheticSource', lambda options: source)
    outcome = aick('simulate', 'out', *SMALL, '--format', format)
    assert (outcome.code, outcome.sentence) == (130, 'interrupted')
    assert list(tmp_path.iterdir()) == []
