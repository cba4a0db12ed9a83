# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The noise of colour and depth images in one pass, as JSON."""

import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.noise import camera_noise
from aick_ros.evaluation.noise.camera_noise import estimate_noise
from aick_ros.geometry.camera import Camera
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources import raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)


def room(**options):
    return SyntheticSource(SyntheticOptions(seed=2, rate=12.0, camera=CAMERA, **options))


def test_both_noises_are_estimated():
    told = []
    found = estimate_noise(room(frames=14), on_progress=told.append)
    assert told == list(range(1, 15))
    assert found.depth.frames == 14
    content = json.loads(json.dumps(found.to_json()))
    assert content['depth_sigma'] == found.depth.depth_sigma
    assert [bin_['sigma'] for bin_ in content['bins']] == [b.sigma for b in found.depth.bins]
    assert content['pixels']['pixel_sigma'] == found.pixels.pixel_sigma
    assert content['pixels']['bins'][0]['scale'] == found.pixels.bins[0].scale
    assert found.pairs == found.pixels.pairs


def test_a_known_misalignment_is_kept_where_the_recording_shows_nothing_else():
    known = {'misalignment.delay': -0.02, 'misalignment.rot_y': 0.01}
    settings = with_values(Settings(), known)
    found = estimate_noise(room(frames=12), settings)
    assert found.misalignment == settings.misalignment
    assert found.to_json()['misalignment'] == {
        'x': 0.0, 'y': 0.0, 'z': 0.0, 'rot_x': 0.0, 'rot_y': 0.01, 'rot_z': 0.0, 'delay': -0.02,
        'colour_readout': 0.0, 'depth_readout': 0.0, 'colour_focal': 0.0, 'depth_focal': 0.0,
        'colour_radial': 0.0}
    assert found.distortion.is_none
    assert not np.any(found.to_json()['distortion'])


def test_a_camera_at_rest_has_depth_noise_only():
    class Still:
        name, ground_truth = 'at rest', None

        def frames(self, on_damaged):
            yield from [next(room(frames=1).frames(raise_damage))] * 12

    found = estimate_noise(Still())
    assert found.depth.depth_sigma > 0
    assert found.pixels is None
    assert found.to_json()['pixels'] is None


def test_what_is_masked_has_no_part_in_the_noise():
    """Nor has it in the motion: another image there changes not one figure."""
    settings = with_values(Settings(), {'sensor.roi_ratios': (0.0, 0.0, 0.0, 0.25)})
    frames = list(room(frames=10).frames(raise_damage))
    rng = np.random.default_rng(1)
    changed = []
    for frame in frames:
        colour, depth = frame.colour.copy(), frame.depth.copy()
        colour[180:] = rng.integers(0, 256, colour[180:].shape)
        depth[180:] = rng.uniform(0.5, 3.0, depth[180:].shape)
        changed.append(dataclasses.replace(frame, colour=colour, depth=depth))
    found, expected = (
        estimate_noise(SimpleNamespace(name='room', frames=lambda on_damaged: iter(seen)),
                       settings).to_json() for seen in (changed, frames))
    assert found == expected


def test_an_empty_recording_is_an_error():
    class Empty:
        name, ground_truth = 'an empty bag', None

        def frames(self, on_damaged):
            return iter(())

    with pytest.raises(InputError, match='an empty bag has no usable frame'):
        estimate_noise(Empty())


def test_each_part_has_the_settings_that_are_its_own(monkeypatch):
    class Part:
        def __init__(self, given):
            parts.append((type(self).__name__, given))
            self.frames, self.pairs = [], 7
            self.misalignment = SimpleNamespace(settings='misalignment')
            self.distortion = 'distortion'

        def add(self, frame):
            self.frames.append(frame)

        register_frame = add

        def model(self, *name):
            return (*name, *self.frames)

    parts, settings, damage = [], Settings(), []
    for name in ('DepthNoiseSamples', 'PixelNoiseSamples', 'Odometry'):
        monkeypatch.setattr(camera_noise, name, type(name, (Part,), {}))
    source = SimpleNamespace(name='desk', frames=lambda on_damaged: (
        on_damaged('torn'), iter([1, 2]))[1])
    found = estimate_noise(source, settings, on_damaged=damage.append)
    assert parts == [('DepthNoiseSamples', settings.sensor), ('PixelNoiseSamples', settings),
                     ('Odometry', settings)]
    assert (found.depth, found.pixels) == (('desk', 1, 2), (1, 2))
    assert (found.pairs, found.misalignment, damage) == (7, 'misalignment', ['torn'])
    assert found.distortion == 'distortion'
