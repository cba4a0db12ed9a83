# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ORB with other settings than the defaults: what each of them says is what is found."""

import dataclasses
import pickle

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.features.orb import OrbDetector
from aick_ros.settings import FeatureSettings, OrbSettings


@pytest.fixture(scope='module')
def grey():
    """Return corners of many sizes and contrasts."""
    rng = np.random.default_rng(0)
    image = np.full((240, 320), 110, np.uint8)
    for _ in range(300):
        corner, size = rng.integers(0, (320, 240)), rng.integers(4, 40, 2)
        cv2.rectangle(image, corner.tolist(), (corner + size).tolist(),
                      int(rng.integers(60, 180)), -1)
    return image


def detect(grey, **settings):
    return OrbDetector(FeatureSettings(orb=OrbSettings(**settings))).detect(grey)


@pytest.mark.parametrize('count', [50, 200])
def test_no_more_keypoints_are_found_than_asked_for(grey, count):
    assert 0.9 * count <= len(detect(grey, nfeatures=count).pixels) <= count


@pytest.mark.parametrize('scale_factor, levels', [(1.2, 8), (1.5, 3), (1.3, 1)])
def test_scales_are_powers_of_the_factor_up_to_the_last_level(grey, scale_factor, levels):
    scales = detect(grey, scale_factor=scale_factor, levels=levels).scales
    powers = np.log(scales) / np.log(scale_factor)
    np.testing.assert_allclose(powers, powers.round(), atol=1e-4)
    assert set(powers.round().astype(int)) == set(range(levels))


@pytest.mark.parametrize('threshold', [0, 40])
def test_no_keypoint_is_at_the_border(grey, threshold):
    found = detect(grey, edge_threshold=threshold, levels=1, patch_size=31)
    pixels = found.pixels
    beyond = min(pixels.min(), (np.subtract(grey.shape[::-1], 1) - pixels).min())
    assert beyond >= threshold
    assert threshold == 40 or beyond < 16


def test_a_larger_contrast_leaves_fewer_corners(grey):
    counts = [len(detect(grey, nfeatures=20000, fast_threshold=threshold).pixels)
              for threshold in (5, 20, 60)]
    assert counts[0] > 1.1 * counts[1] > 1.3 * counts[2] > 0


def test_a_corner_without_contrast_is_none():
    step = np.full((100, 100), 100, np.uint8)
    step[40:60, 40:60] = 125
    assert len(detect(step, fast_threshold=24).pixels) > 0
    assert len(detect(step, fast_threshold=26).pixels) == 0


def test_the_patch_is_what_is_described(grey):
    """What is farther away than its half changes no descriptor."""
    def blank_beyond(half):
        image, (u, v) = np.zeros_like(grey), (160, 120)
        near = slice(v - half, v + half + 1), slice(u - half, u + half + 1)
        image[near] = grey[near]
        return image

    def nearest(image, patch):
        found = detect(image, levels=1, patch_size=patch, nfeatures=20000, edge_threshold=60)
        best = np.linalg.norm(found.pixels - (160, 120), axis=1).argmin()
        return found.pixels[best], found.descriptors[best]
    pixel, descriptor = nearest(grey, 15)
    again, other = nearest(blank_beyond(40), 15)
    np.testing.assert_array_equal(pixel, again)
    np.testing.assert_array_equal(descriptor, other)
    assert (nearest(grey, 61)[1] != descriptor).any()


def test_responses_are_those_of_harris(grey):
    found = detect(grey, levels=1)
    assert (found.responses > 0).all()
    harris = cv2.cornerHarris(grey, 7, 3, 0.04)
    u, v = found.pixels.astype(int).T
    assert np.corrcoef(np.argsort(np.argsort(harris[v, u])),
                       np.argsort(np.argsort(found.responses)))[0, 1] > 0.95


@pytest.mark.parametrize('factor, levels, least', [(2.0, 4, 16), (1.95, 4, 15), (1.2, 8, 8)])
def test_an_image_smaller_than_its_pyramid_is_rejected(factor, levels, least):
    """The coarsest level has at least two rows and columns: 2 * 2^3 = 16 pixels at the fourth."""
    assert len(detect(np.zeros((least, 40), np.uint8), scale_factor=factor,
                      levels=levels).pixels) == 0
    for rows, columns in ((least - 1, 40), (40, least - 1)):
        with pytest.raises(InputError, match=f'an image of {columns} x {rows} pixels is too sm'):
            detect(np.zeros((rows, columns), np.uint8), scale_factor=factor, levels=levels)


def test_another_process_gets_the_same_detector(grey):
    detector = OrbDetector(FeatureSettings(orb=OrbSettings(nfeatures=77, levels=2)))
    again = pickle.loads(pickle.dumps(detector))
    for field in dataclasses.fields(one := detector.detect(grey)):
        np.testing.assert_array_equal(getattr(one, field.name),
                                      getattr(again.detect(grey), field.name))
