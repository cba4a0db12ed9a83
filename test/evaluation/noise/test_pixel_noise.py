# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Noise of keypoints, against noise added to them and against rendered rooms."""

import dataclasses
from functools import cache

import cv2
import numpy as np
import pytest

from aick_ros.evaluation.noise import pixel_noise
from aick_ros.evaluation.noise.pixel_noise import PixelNoiseSamples
from aick_ros.features import Features, make_detector
from aick_ros.frames import depth
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values
from aick_ros.sources.synthetic import SyntheticOptions, SyntheticSource

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
NO_DEPTH = np.full((240, 320), np.nan, np.float32)
STEP = 10  # px, that the picture moves from one frame to the next


def picture(index, step=STEP):
    """Return a part of a large texture, another one for each index."""
    return texture()[:, step * index:step * index + 320].astype(np.uint8)


@cache
def texture():
    noise = np.random.default_rng(0).uniform(0, 255, (240, 900)).astype(np.float32)
    return cv2.normalize(cv2.GaussianBlur(noise, None, 2.0), None, 0, 255, cv2.NORM_MINMAX)


def frames(count, step=STEP):
    return [RgbdFrame(i, picture(i, step), NO_DEPTH, CAMERA) for i in range(count)]


def model_of(frames_, **changes):
    settings = with_values(Settings(), {f'features.{k}': v for k, v in changes.items()})
    samples = PixelNoiseSamples(settings)
    for frame in frames_:
        samples.add(frame)
    return samples.model()


class KnownDetector:
    """Finds the same points of the moving texture, each time with noise of a known size."""

    def __init__(self, sigma, exponent):
        rng = np.random.default_rng(1)
        self._places = np.stack(np.meshgrid(np.arange(10, 900, 13.0), np.arange(10, 230, 13.0)),
                                axis=-1).reshape(-1, 2)
        count = len(self._places)
        self._scales = rng.choice(2.0 ** (np.arange(8) / 4), count)
        self._sigmas = sigma * self._scales ** exponent
        self._descriptors = rng.integers(0, 256, (count, 32), dtype=np.uint8)
        self._rng, self._index = rng, 0

    def detect(self, grey):
        places = self._places - (STEP * self._index, 0)
        self._index += 1
        seen = np.flatnonzero((places[:, 0] >= 5) & (places[:, 0] < 315))
        noise = self._rng.normal(size=(len(seen), 2)) * self._sigmas[seen, None]
        return Features(np.float32(places[seen] + noise), self._descriptors[seen],
                        np.ones(len(seen), np.float32), np.float32(self._scales[seen]))


@pytest.mark.parametrize('sigma, exponent', [(0.3, 0.0), (0.3, 1.0), (0.5, 0.5)])
def test_noise_added_to_keypoints_is_recovered(monkeypatch, sigma, exponent):
    monkeypatch.setattr(pixel_noise, 'make_detector', lambda _: KnownDetector(sigma, exponent))
    found = model_of(frames(25))
    assert found.pairs == 24
    assert found.exponent_estimated
    assert found.pixel_exponent == pytest.approx(exponent, abs=0.08)
    assert len(found.bins) == 8
    for bin_ in found.bins:
        assert bin_.model == pytest.approx(sigma * bin_.scale ** exponent, rel=0.06)


@pytest.fixture(scope='module')
def room():
    """Return a room, frames of it as a real camera would take them, and their exact depth."""
    source = SyntheticSource(SyntheticOptions(seed=6, frames=100, camera=CAMERA))
    truth = SyntheticSource(SyntheticOptions.perfect(seed=6, frames=100, camera=CAMERA))
    indices = range(0, 100, 5)
    return source, [source.frame(i) for i in indices], [truth.frame(i).depth for i in indices]


def true_noise(source, frames_, depths, detector):
    """Return scales, and distances by the square root of two from where the truth has them."""
    settings, scales, distances = Settings().sensor, [], []
    for before, now, exact in zip(frames_, frames_[1:], depths):
        first, second = detector.detect(before.grey), detector.detect(now.grey)
        points = CAMERA.back_project(first.pixels, depth.sample(exact, first.pixels, settings))
        T = se3.inverse(source.pose(now.stamp)) @ source.pose(before.stamp)
        seen = CAMERA.project(se3.transform(T, points))
        apart = np.linalg.norm(seen[:, None] - second.pixels[None], axis=2)
        apart[~np.isfinite(apart)] = np.inf
        apart[np.abs(np.log(first.scales[:, None] / second.scales)) > 0.09] = np.inf
        nearest = apart.argmin(axis=1)
        rows = np.flatnonzero((apart.min(axis=1) < 3 * first.scales)
                              & (apart.argmin(axis=0)[nearest] == np.arange(len(nearest))))
        scales.append(first.scales[rows])
        distances.append(apart[rows, nearest[rows]])
    return np.concatenate(scales), np.concatenate(distances) / 2 ** 0.5


@pytest.mark.parametrize('name, tolerance', [('orb', 0.12), ('surf', 0.3), ('sift', 0.4)])
def test_in_a_rendered_room_it_is_the_reprojection_error(room, name, tolerance):
    """Heavy tails (SURF, SIFT) and the noise of the optical flow contribute to the difference."""
    source, taken, depths = room
    found = model_of(taken, detector=name)
    assert found.detector == name
    features = dataclasses.replace(Settings().features, detector=name)
    scales, distances = true_noise(source, taken, depths, make_detector(features))
    compared = 0
    for bin_ in found.bins:
        near = np.abs(np.log(scales / bin_.scale)) < 0.09
        if bin_.matches >= 200 and near.sum() >= 200:
            true_sigma = np.median(distances[near]) / np.sqrt(2 * np.log(2))
            assert bin_.sigma == pytest.approx(true_sigma, rel=tolerance)
            compared += 1
    assert compared >= 3


@pytest.mark.parametrize('frames_', [
    frames(1), frames(30, step=0), frames(4),
    [dataclasses.replace(frame, colour=np.zeros_like(frame.colour)) for frame in frames(20)]],
    ids=['one frame', 'a camera at rest', 'too few', 'darkness'])
def test_too_little_data_gives_no_model(frames_):
    assert model_of(frames_) is None


def test_frames_are_skipped_until_the_flow_is_large_enough():
    samples = PixelNoiseSamples()
    for frame in frames(21, step=1):
        samples.add(frame)
    assert samples.pairs == 2  # by eight pixels and more, twice


def test_few_scales_keep_the_exponent_of_the_settings():
    changes = {'orb.levels': 2, 'orb.pixel_exponent': 0.6}
    found = model_of(frames(20), **changes)
    assert not found.exponent_estimated
    assert found.pixel_exponent == 0.6


def test_images_of_another_size_start_again():
    small = Camera(160, 120, 131, 131, 79.5, 59.5)
    odd = RgbdFrame(9, picture(0)[:120, :160].copy(), NO_DEPTH[:120, :160], small)
    samples = PixelNoiseSamples()
    for frame in [*frames(3), odd, *frames(3)]:
        samples.add(frame)
    assert samples.pairs == 4
