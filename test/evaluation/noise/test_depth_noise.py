# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The noise model of sensors whose noise is known, from images of a rendered room."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.evaluation.noise.depth_noise import DepthNoiseSamples
from aick_ros.evaluation.noise.noise_law import bins_of
from aick_ros.evaluation.noise.patch_noise import PatchNoise
from aick_ros.settings import SensorSettings
from aick_ros.sources import open_source, raise_damage
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource
from aick_ros.sources.synthetic.sensor import DepthSensor

FRAMES = range(0, 120, 10)
TOTAL = np.hypot(0.0013, 0.0029 / 12 ** 0.5)
"""Noise and quantisation of the default sensor at one metre [m]."""


class Recorded:
    """A source of frames in memory, each with its depth changed."""

    name, ground_truth = 'a room', None

    def __init__(self, frames, measure):
        self._frames = [dataclasses.replace(frame, depth=measure(frame, rng).astype(np.float32))
                        for frame, rng in zip(frames, map(np.random.default_rng, range(99)))]

    def __len__(self):
        return len(self._frames)

    def frames(self, on_damaged):
        yield from self._frames


@pytest.fixture(scope='module')
def room():
    """Return twelve frames of a room without noise, from one to two and a half metres."""
    source = SyntheticSource(SyntheticOptions.perfect(seed=3, frames=FRAMES.stop))
    return [source.frame(i) for i in FRAMES]


def estimate(source, sensor=SensorSettings()):
    samples = DepthNoiseSamples(sensor)
    for frame in source.frames(raise_damage):
        samples.add(frame)
    return samples.model(source.name)


def seen_by(sensor):
    return lambda frame, rng: sensor.measure(frame.depth, frame.camera, rng)


def grown(sigma, exponent):
    """Return a function that adds independent noise by a power law of the depth."""
    return lambda frame, rng: (frame.depth + sigma * frame.depth ** exponent
                               * rng.normal(size=frame.depth.shape))


@pytest.mark.parametrize('sensor, sigma', [
    (DepthSensor(grain=0.0, edge_jitter=0.0, step=0.0), 0.0013),
    (DepthSensor(grain=0.0, edge_jitter=0.0), TOTAL),
    (DepthSensor(edge_jitter=0.0), TOTAL),
    (DepthSensor(sigma=0.004, edge_jitter=0.0), np.hypot(0.004, 0.0029 / 12 ** 0.5)),
], ids=['white', 'quantised', 'grain', 'stereo'])
def test_triangulating_sensors(room, sensor, sigma):
    found = estimate(Recorded(room, seen_by(sensor)))
    assert found.exponent_estimated
    assert found.depth_exponent == pytest.approx(2.0, abs=0.1)
    for bin_ in found.bins:
        # neighbours that are alike hide 3 % of their noise in the plane; furniture adds a little
        assert bin_.model == pytest.approx(sigma * bin_.depth ** 2, rel=0.08)
        assert bin_.sigma == pytest.approx(sigma * bin_.depth ** 2, rel=0.15)


def test_lateral_jitter_adds_noise(room):
    """Half a pixel on surfaces at an angle: more than without, and by less than a half."""
    found = estimate(Recorded(room, seen_by(DepthSensor())))
    sigma = found.depth_sigma * 1.5 ** (found.depth_exponent - 2.0)
    assert TOTAL < sigma < 1.2 * TOTAL


@pytest.mark.parametrize('sigma, exponent', [(0.01, 0.0), (0.005, 1.0), (0.002, 2.0)])
def test_the_exponent_is_that_of_the_sensor(room, sigma, exponent):
    found = estimate(Recorded(room, grown(sigma, exponent)))
    assert found.exponent_estimated
    assert found.depth_exponent == pytest.approx(exponent, abs=0.1)
    for bin_ in found.bins:
        assert bin_.model == pytest.approx(sigma * bin_.depth ** exponent, rel=0.08)


def test_a_small_range_of_depth_keeps_the_exponent_of_the_settings(room):
    source = Recorded(room, grown(0.01, 0.0))
    narrow = {'min_depth': 1.2, 'max_depth': 1.9}
    kept = estimate(source, SensorSettings(**narrow))
    assert not kept.exponent_estimated
    assert kept.depth_exponent == 2.0
    # in the middle of the depths it is right, whatever the exponent
    assert kept.depth_sigma * 1.5 ** 2 == pytest.approx(0.01, rel=0.15)
    constant = estimate(source, SensorSettings(depth_exponent=0.0, **narrow))
    assert not constant.exponent_estimated
    assert constant.depth_sigma == pytest.approx(0.01, rel=0.03)


def test_facts_of_the_recording(room):
    found = estimate(Recorded(room, grown(0.01, 0.0)))
    depths = np.concatenate([frame.depth.ravel() for frame in room])
    nearest, farthest = np.nanpercentile(depths, (0.1, 99.9))
    assert found.nearest == pytest.approx(nearest, rel=0.1)
    assert found.farthest == pytest.approx(farthest, rel=0.1)
    assert found.frames == len(FRAMES)
    assert found.source == 'a room'


def test_bins_are_those_of_the_patches_of_all_frames(room):
    frames = list(Recorded(room, grown(0.01, 0.0)).frames(raise_damage))
    noises = [PatchNoise.of(frame.depth, frame.camera, SensorSettings()) for frame in frames]
    bins = bins_of(np.concatenate([noise.depths for noise in noises]),
                   np.concatenate([noise.sigmas for noise in noises]))
    found = estimate(Recorded(room, grown(0.01, 0.0)))
    assert [(bin_.depth, bin_.patches, bin_.sigma) for bin_ in found.bins] == [
        (bin_.at, bin_.count, bin_.sigma) for bin_ in bins]


def test_few_outliers_do_not_widen_the_range_of_depth(room):
    """One in 1200 of the pixels that are looked at, at either end."""
    def with_outliers(frame, rng):
        depth = grown(0.01, 0.0)(frame, rng)
        depth[0, 0], depth[-16, -16] = 0.15, 9.5
        return depth

    without, found = (estimate(Recorded(room, measure))
                      for measure in (grown(0.01, 0.0), with_outliers))
    assert found.nearest == pytest.approx(without.nearest, rel=0.05)
    assert found.farthest == pytest.approx(without.farthest, rel=0.05)


def test_recordings_without_usable_data_are_rejected(room):
    with pytest.raises(InputError, match='a room has no usable frame'):
        estimate(Recorded([], None))
    with pytest.raises(InputError, match='a room: its depth has no noise; record with a real '
                       'camera, or render without --perfect'):
        estimate(Recorded(room, lambda frame, rng: frame.depth))
    with pytest.raises(InputError, match='a room: 0 patches of smooth surface between 0.1 '
                       'and 10 m, in 12 frames, are too few to estimate the depth noise .at least '
                       '30 at about the same depth are required.: record walls, floors and'):
        estimate(Recorded(room, lambda frame, rng: np.nan * frame.depth))


@pytest.mark.parametrize('name', ['freiburg1_xyz_150', 'freiburg1_rpy_100'])
def test_a_real_kinect_is_near_its_published_noise(tum_folder, name):
    """1.4 mm at one metre on targets (Khoshelham and Elberink 2012); a desk is rougher."""
    found = estimate(open_source(str(tum_folder(name))))
    assert found.exponent_estimated
    for bin_ in found.bins:
        assert 0.7 < bin_.model / (0.001425 * bin_.depth ** 2) < 1.7
