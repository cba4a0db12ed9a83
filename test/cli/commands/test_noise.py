# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The noise model on the terminal: a parameter file, a table, JSON."""

import dataclasses
import json
import re

import numpy as np
import pytest
import yaml

from aick_ros.cli.commands import noise as noise_module
from aick_ros.cli.input.settings_file import read_settings_file
from aick_ros.errors import InputError
from aick_ros.evaluation.noise.camera_noise import CameraNoise
from aick_ros.evaluation.noise.depth_noise import DepthBin, DepthNoise
from aick_ros.evaluation.noise.pixel_noise import PixelNoise, ScaleBin
from aick_ros.frames.depth_distortion import COLUMNS, ROWS, DepthDistortion
from aick_ros.settings import MisalignmentSettings, Settings
from aick_ros.sources import raise_damage

NARROW = ('--set', 'sensor.min_depth=1.2', '--set', 'sensor.max_depth=1.6')


@pytest.fixture
def noise(aick, monkeypatch):
    """Return a function that estimates the noise of a source in memory."""
    def run(source, *arguments):
        monkeypatch.setattr(noise_module, 'open_source', lambda path, options: source)
        return aick('noise', 'a source', *arguments)
    return run


def test_the_output_is_a_parameter_file(noise, recording, tmp_path):
    outcome = noise(recording, '--json', tmp_path / 'noise.json')
    figures = json.loads((tmp_path / 'noise.json').read_text())
    assert outcome.code == 0
    file = tmp_path / 'camera.yaml'
    file.write_text(outcome.out[outcome.out.index('/**:'):])
    settings = read_settings_file(file).applied_to(Settings())
    sensor, orb, pixels = settings.sensor, settings.features.orb, figures['pixels']
    assert sensor.depth_sigma == pytest.approx(figures['depth_sigma'], abs=5e-6)
    assert sensor.depth_exponent == pytest.approx(figures['depth_exponent'], abs=5e-3)
    assert orb.pixel_sigma == pytest.approx(pixels['pixel_sigma'], abs=5e-3)
    assert orb.pixel_exponent == pytest.approx(pixels['pixel_exponent'], abs=5e-3)
    assert f'depths from {figures["nearest"]:.2f} to {figures["farthest"]:.2f} m' in outcome.out


def test_the_parameter_file_has_the_misalignment_too(noise, recording, tmp_path):
    known = {'delay': -0.02, 'rot_y': 0.01, 'x': 0.025}
    assignments = [part for name, value in known.items()
                   for part in ('--set', f'misalignment.{name}={value}')]
    outcome = noise(recording, '--json', tmp_path / 'noise.json', '--limit', '6', *assignments)
    file = tmp_path / 'camera.yaml'
    file.write_text(outcome.out[outcome.out.index('/**:'):])
    assert '# depth images are taken 20 ms earlier than their stamps say' in outcome.out
    settings = read_settings_file(file).applied_to(Settings())
    assert dataclasses.asdict(settings.misalignment) == {
        **dataclasses.asdict(Settings().misalignment), **known}
    assert json.loads((tmp_path / 'noise.json').read_text())['misalignment'] == dataclasses.asdict(
        settings.misalignment)


def test_a_distortion_of_depth_is_said_in_the_parameter_file(recording):
    nodes = np.full((ROWS, COLUMNS), 0.0031)
    found = CameraNoise(DEPTH, 3, PIXELS, MisalignmentSettings(), DepthDistortion(nodes))
    line, = (line for line in noise_module._lines(found) if 'distorted' in line)
    assert line.startswith('    # depth images are distorted') and '3.1 mm' in line
    assert found.to_json()['distortion'] == nodes.tolist()


def test_the_table_compares_model_and_measurement(noise, recording, tmp_path):
    outcome = noise(recording, '--json', tmp_path / 'noise.json')
    figures = json.loads((tmp_path / 'noise.json').read_text())
    table = outcome.out[:outcome.out.index('/**:')]
    words = [line.split() for line in table.splitlines()]
    for heads in (['depth', 'noise'], ['depth', 'sigma', 'model'],
                  ['[m]', 'patches', '[mm]', '[mm]'], ['noise', 'of', 'orb', 'keypoints'],
                  ['sigma', 'model'], ['scale', 'matches', '[px]', '[px]']):
        assert heads in words
    for bin_ in figures['bins']:
        assert [f'{bin_["depth"]:.2f}', str(bin_['patches']), f'{1e3 * bin_["sigma"]:.2f}',
                f'{1e3 * bin_["model"]:.2f}'] in [line.split() for line in table.splitlines()]
    for bin_ in figures['pixels']['bins']:
        assert [f'{bin_["scale"]:.2f}', str(bin_['matches']), f'{bin_["sigma"]:.2f}',
                f'{bin_["model"]:.2f}'] in [line.split() for line in table.splitlines()]


def test_json_on_standard_output_stands_alone(noise, recording):
    outcome = noise(recording, '--json', '-', '--limit', '6')
    figures = json.loads(outcome.out)
    assert (figures['frames'], figures['ended'], figures['damaged_images']) == (6, 'complete', 0)
    assert 'sensor.depth_sigma' in outcome.err


def test_a_small_range_of_depth_is_reported(noise, recording):
    outcome = noise(recording, *NARROW)
    assert outcome.code == 0
    assert 'too small to estimate how the noise grows with depth' in outcome.sentence
    parameters = yaml.safe_load(outcome.out[outcome.out.index('/**:'):])['/**']['ros__parameters']
    assert parameters['sensor.depth_exponent'] == 2.0
    outcome = noise(recording, *NARROW, '--set', 'sensor.depth_exponent=0.5')
    assert 'sensor.depth_exponent: 0.50  # kept, not measured' in outcome.out


def test_a_camera_at_rest_is_reported(noise, recording, in_memory):
    still = in_memory([next(recording.frames(raise_damage))] * 8)
    outcome = noise(still)
    assert outcome.code == 0
    assert 'with a flow of 8 pixels or more are required, there are 0' in outcome.err
    assert 'sensor.depth_sigma' in outcome.out
    assert 'pixel_sigma' not in outcome.out


def test_the_keypoints_are_those_of_the_detector(noise, recording):
    outcome = noise(recording, '--set', 'features.detector=sift')
    assert 'noise of sift keypoints' in outcome.out
    assert 'features.sift.pixel_sigma: 0.' in outcome.out
    assert 'features.orb' not in outcome.out


def test_unusable_input_is_rejected_in_one_sentence(noise, recording, in_memory, tmp_path):
    blind = in_memory([dataclasses.replace(frame, depth=np.full_like(frame.depth, np.nan))
                       for frame in recording.frames(raise_damage)])
    outcome = noise(blind, '--json', tmp_path / 'noise.json')
    assert outcome.code == 2
    assert outcome.sentence.startswith('in memory: 0 patches of smooth surface')
    assert noise(recording, '--json', tmp_path / 'no' / 'noise.json').code == 2
    assert list(tmp_path.iterdir()) == []


def test_damaged_images_and_a_broken_end_are_reported(noise, recording, in_memory):
    def broken(index, on_damaged):
        on_damaged(InputError(f'torn before {index}'))
        if index == 10:
            raise InputError('the index is broken')

    source = in_memory(list(recording.frames(raise_damage)), on_frame=broken)
    outcome = noise(source, '--json', '-')
    figures = json.loads(outcome.out)
    assert outcome.code == 2
    assert (figures['frames'], figures['damaged_images']) == (10, 11)
    assert figures['ended'] == 'the index is broken'


DEPTH = DepthNoise('desk', 41, 0.456, 3.21, 0.001234, 1.75, True,
                   [DepthBin(0.5, 100, 0.001, 0.0011), DepthBin(3.0, 90, 0.009, 0.0085)])
PIXELS = PixelNoise('surf', 7, 0.246, 0.81, True,
                    [ScaleBin(1.0, 300, 0.25, 0.24), ScaleBin(2.0, 45, 0.4, 0.43)])


@pytest.mark.parametrize('depth, pixels, said', [
    ({}, {}, []),
    ({'exponent_estimated': False}, {},
     ['smooth surfaces from 0.50 to 3.00 m only: .*sensor.depth_exponent is kept at 1.75. 2 is']),
    ({}, None, ['at least 5 pairs of textured images with a flow of 8 pixels .* there are 3; r']),
    ({}, {'exponent_estimated': False},
     ['surf keypoints of about one scale only: features.surf.pixel_exponent is kept at 0.81']),
    ({'exponent_estimated': False}, None, ['sensor.depth_exponent is kept', 'at least 5 pairs'])])
def test_what_a_recording_does_not_determine_is_said_and_marked(depth, pixels, said):
    found = CameraNoise(dataclasses.replace(DEPTH, **depth), 3,
                        None if pixels is None else dataclasses.replace(PIXELS, **pixels),
                        MisalignmentSettings(delay=0.0123, x=-0.02))
    sentences = list(noise_module._shortcomings(found))
    assert len(sentences) == len(said)
    assert all(re.search(each, sentence) for each, sentence in zip(said, sentences))
    lines = list(noise_module._lines(found))
    text = '\n'.join(lines)
    expected = {'sensor.depth_sigma': 0.00123, 'sensor.depth_exponent': 1.75,
                'misalignment.delay': 0.0123, 'misalignment.x': -0.02}
    if pixels is not None:
        expected |= {'features.surf.pixel_sigma': 0.25, 'features.surf.pixel_exponent': 0.81}
        assert '# 345 keypoints detected in two images' in text
    assert yaml.safe_load(text)['/**']['ros__parameters'] == expected
    assert '# measured with aick noise: desk, 41 frames' in text
    assert '# depths from 0.46 to 3.21 m, smooth surfaces from 0.50 to 3.00 m' in text
    kept = [line.split(':')[0].strip() for line in lines if line.endswith('# kept, not measured')]
    assert kept == [name for name, known in (
        ('sensor.depth_exponent', depth), ('features.surf.pixel_exponent', pixels)) if known]


def test_one_frame_is_one():
    found = CameraNoise(dataclasses.replace(DEPTH, frames=1), 0, None, MisalignmentSettings())
    text = '\n'.join(noise_module._lines(found))
    assert 'desk, 1 frame\n' in text and 'misalignment' not in text
