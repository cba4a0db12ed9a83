# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which keypoints of two images are compared, with a detector and a flow that are given."""

import numpy as np
import pytest

from aick_ros.evaluation.noise import pixel_noise
from aick_ros.evaluation.noise.pixel_noise import MIN_FLOW, PixelNoiseSamples
from aick_ros.features import Features
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera
from aick_ros.settings import Settings
from aick_ros.settings.parameter import with_values

CAMERA = Camera(64, 48, 60.0, 60.0, 31.5, 23.5)
COUNT = 40
PLACES = 100.0 * np.arange(COUNT)[:, None] * [1.0, 0.0]
BITS = np.random.default_rng(0).integers(0, 2, (COUNT, 256), dtype=np.uint8)


class Given:
    """
    Keypoints as a tracker and a detector see them, image by image.

    :param flow: of all keypoints, along a row [px].
    :param error: of the detector against the flow, from one image to the next [px].
    :param scale: of the first image.
    :param growth: of the scale, from one image to the next.
    :param bits: of 256 that differ from one image to the next.
    :param tracked: share of the keypoints that are tracked.
    :param twins: in every other image each keypoint is found twice, two pixels apart.
    """

    def __init__(self, flow=10.0, error=1.0, scale=1.0, growth=1.0, bits=0, tracked=1.0,
                 twins=False):
        self.flow, self.error, self.scale, self.growth = flow, error, scale, growth
        self.bits, self.tracked, self.twins = bits, tracked, twins
        self.number, self.compared = -1, []

    def detect(self, grey):
        self.number += 1
        bits = BITS.copy()
        bits[:, :self.bits * (self.number % 2)] ^= 1
        pixels = PLACES + [self.number * (self.flow + self.error), 0.0]
        if self.twins and self.number % 2 == 0:
            other = bits.copy()
            other[:, -5:] ^= 1
            pixels, bits = np.r_[pixels + [0.0, 2.0], pixels], np.r_[other, bits]
        scales = np.full(len(pixels), self.scale * self.growth ** self.number)
        return Features(np.float32(pixels), np.packbits(bits, axis=1),
                        np.ones(len(pixels), np.float32), np.float32(scales))

    def track(self, before, now, pixels):
        self.compared.append((int(before.level(0).min()), int(now.level(0).min())))
        found = np.arange(len(pixels)) < round(self.tracked * len(pixels))
        return pixels + np.float32([self.flow, 0.0]), found


@pytest.fixture
def collect(monkeypatch):
    """Return a function that returns what is collected of images numbered by their grey."""
    def of(given, count=6, settings=Settings()):
        monkeypatch.setattr(pixel_noise, 'make_detector', lambda _: given)
        monkeypatch.setattr(pixel_noise, 'track_there_and_back', given.track)
        samples = PixelNoiseSamples(settings)
        for number in range(count):
            samples.add(RgbdFrame(number, np.full((48, 64), number, np.uint8),
                                  np.full((48, 64), np.nan, np.float32), CAMERA))
        return samples
    return of


def matches(samples):
    found = samples.model()
    return 0 if found is None else sum(bin_.matches for bin_ in found.bins)


@pytest.mark.parametrize('error, scale', [(0.5, 1.0), (-3.0, 1.0), (3.0, 2.0)])
def test_the_noise_of_both_images_is_in_a_distance(collect, error, scale):
    """Two points with unit noise on each axis have a median distance of 2 sqrt(ln 2)."""
    bin_, = collect(Given(error=error, scale=scale)).model().bins
    assert (bin_.scale, bin_.matches) == (pytest.approx(scale), 5 * COUNT)
    assert bin_.sigma == pytest.approx(abs(error) / (2 * np.log(2) ** 0.5), rel=1e-3)


@pytest.mark.parametrize('given, is_matched', [
    (Given(error=4.9), True), (Given(error=5.1), False),
    (Given(error=9.9, scale=2.0), True), (Given(error=10.1, scale=2.0), False),
    (Given(growth=1.09), True), (Given(growth=1.11), False),
    (Given(growth=1 / 1.09), True), (Given(growth=1 / 1.11), False),
    (Given(bits=51), True), (Given(bits=52), False)])
def test_a_match_is_near_of_the_same_scale_and_similar(collect, given, is_matched):
    """Five pixels at the finest scale, a tenth of the scale, a fifth of the bits."""
    assert matches(collect(given)) == (5 * COUNT if is_matched else 0)


def test_similar_is_what_the_settings_say(collect):
    strict = with_values(Settings(), {'aick.lambda_f': 0.1})
    assert matches(collect(Given(bits=25), settings=strict)) == 5 * COUNT
    assert matches(collect(Given(bits=26), settings=strict)) == 0


def test_a_keypoint_is_compared_with_one_alone(collect):
    samples = collect(Given(twins=True))
    assert matches(samples) == 5 * COUNT
    # with the one that is the most similar
    assert samples.model().bins[0].sigma == pytest.approx(0.5 / np.log(2) ** 0.5, rel=1e-3)


@pytest.mark.parametrize('flow, compared', [
    (MIN_FLOW, [(i, i + 1) for i in range(5)]), (MIN_FLOW - 0.1, [(0, i + 1) for i in range(5)])])
def test_the_first_image_of_a_pair_is_kept_until_the_flow_is_large_enough(
        collect, flow, compared):
    given = Given(flow=flow)
    assert collect(given).pairs == (5 if flow == MIN_FLOW else 0)
    assert given.compared == compared


@pytest.mark.parametrize('tracked, pairs', [(0.35, 0), (0.3, 0), (0.25, 5)])
def test_where_few_are_tracked_the_next_image_comes_first(collect, tracked, pairs):
    assert collect(Given(flow=1.0, tracked=tracked)).pairs == pairs


def test_without_a_tracked_keypoint_there_is_no_pair(collect):
    given = Given(tracked=0.0)
    assert collect(given).pairs == 0
    assert given.compared == [(i, i + 1) for i in range(5)]


def test_five_pairs_are_enough_and_a_hundred_all(collect):
    assert collect(Given(), 5).model() is None
    assert collect(Given(), 6).model().pairs == 5
    assert collect(Given(), 105).model().pairs == 100
