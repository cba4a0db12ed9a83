# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""ORB with other settings than the defaults: what each of them says is what is found."""

import dataclasses
import math
import pickle

import cv2
import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.errors import InputError
from aick_ros.features.image_noise import noise_of
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


def detect(grey, min_fast_threshold=255, **settings):
    """Return the keypoints of one threshold; of weaker corners too, where that is lower."""
    return OrbDetector(FeatureSettings(orb=OrbSettings(
        min_fast_threshold=min_fast_threshold, **settings))).detect(grey)


def opencv(grey, orb):
    """
    Return OpenCV's keypoints, sorted: response, place, scale, descriptor.

    Corners by Harris' measure, pairs of points, from the first level, as in the paper.
    """
    detector = cv2.ORB_create(
        nfeatures=orb.nfeatures, scaleFactor=orb.scale_factor, nlevels=orb.levels,
        edgeThreshold=orb.edge_threshold, patchSize=orb.patch_size,
        fastThreshold=orb.fast_threshold, scoreType=cv2.ORB_HARRIS_SCORE, WTA_K=2, firstLevel=0)
    keypoints, descriptors = detector.detectAndCompute(grey, None)
    return sorted(
        (keypoint.response, *keypoint.pt, np.float32(np.float32(orb.scale_factor).item()
                                                     ** keypoint.octave), bytes(descriptor))
        for keypoint, descriptor in zip(keypoints, descriptors if keypoints else ()))


def sorted_rows(features):
    return sorted((response, *pixel, scale, bytes(descriptor)) for response, pixel, scale,
                  descriptor in zip(features.responses, features.pixels, features.scales,
                                    features.descriptors))


@pytest.mark.parametrize('settings', [
    {}, {'nfeatures': 700, 'scale_factor': 1.44, 'levels': 4}, {'nfeatures': 10},
    {'edge_threshold': 0}, {'edge_threshold': 31}, {'edge_threshold': 100}, {'patch_size': 5},
    {'patch_size': 30}, {'patch_size': 101, 'levels': 2}, {'levels': 1},
    {'scale_factor': 1.01, 'levels': 16}, {'scale_factor': 2.0, 'levels': 3},
    {'fast_threshold': 1, 'nfeatures': 20000}, {'fast_threshold': 255}], ids=str)
def test_keypoints_are_those_of_opencv(grey, settings):
    """Of corners, of noise, of noise that is blurred, transposed and strided, and of nothing."""
    rng = np.random.default_rng(1)
    noise = rng.integers(0, 256, (150, 201), dtype=np.uint8)
    for image in (grey, grey[:, ::2], noise, cv2.blur(noise, (5, 5)).T, np.zeros_like(grey)):
        found = detect(image, **settings)
        assert sorted_rows(found) == opencv(image, OrbSettings(**settings))


def test_smaller_images_are_those_of_opencv():
    """Of any two sizes, to the last digit."""
    rng = np.random.default_rng(2)
    for _ in range(500):
        height, width = rng.integers(1, 90, 2)
        image = rng.integers(0, 256, (height, width), dtype=np.uint8)
        smaller = np.empty((rng.integers(1, height + 1), rng.integers(1, width + 1)), np.uint8)
        kernels.shrink(image, smaller)
        known = cv2.resize(image, smaller.shape[::-1], interpolation=cv2.INTER_LINEAR_EXACT)
        np.testing.assert_array_equal(smaller, known.reshape(smaller.shape))


@pytest.mark.parametrize('shape', [(21, 30), (20, 31)])
def test_an_image_is_not_made_larger(shape):
    with pytest.raises(ValueError, match='larger than the image'):
        kernels.shrink(np.zeros((20, 30), np.uint8), np.zeros(shape, np.uint8))


@pytest.mark.parametrize('width', [0, 1, 5, 6, 7, 8, 30, 38, 39, 40, 70])
@pytest.mark.parametrize('height', [0, 6, 7, 9, 33])
def test_corners_of_small_images_are_those_of_opencv(width, height):
    image = np.random.default_rng(width).integers(0, 256, (height, width), dtype=np.uint8)
    bordered = np.random.default_rng(0).integers(
        0, 256, (height + 10, width + 10), dtype=np.uint8)
    bordered[5:-5, 5:-5] = image
    corners = np.frombuffer(kernels.corners(bordered, 5, 20, 0, 10 ** 6),
                            np.float32).reshape(-1, 3)
    expected = cv2.FastFeatureDetector_create(20).detect(image) if image.size else []
    assert sorted(map(tuple, corners[:, :2])) == sorted(point.pt for point in expected)


@pytest.mark.parametrize('arguments, error', [
    ((np.zeros((20, 20), np.uint8), 4, 20, 0, 9), ValueError),
    ((np.zeros((20, 20), np.uint8), 11, 20, 0, 9), ValueError),
    ((np.zeros((20, 40), np.uint8), -5, 20, 0, 9), ValueError),
    ((np.zeros(400, np.uint8), 5, 20, 0, 9), ValueError),
    ((np.zeros((20, 20), np.uint8), 5, 256, 0, 9), OverflowError),
    ((np.zeros((20, 20), np.float32), 5, 20, 0, 9), TypeError)])
def test_images_of_another_type_or_size_have_no_corners(arguments, error):
    with pytest.raises(error):
        kernels.corners(*arguments)


@pytest.mark.parametrize('point, half_widths', [
    ((-1, 0), [3, 3]), ((10, 0), [3, 3]), ((0, 10), [3, 3]), ((np.nan, 0), [1, 1]),
    ((0, 0), [2, 2]), ((0, 0), [1, -1]), ((0, 0), [1, 1, 1]), ((0, 0), [])], ids=str)
def test_discs_beyond_the_image_have_no_direction(point, half_widths):
    with pytest.raises(ValueError):
        kernels.disc_directions(np.zeros((28, 28), np.uint8), 9, np.array(half_widths, np.int64),
                                np.float32([point]), np.empty(1))


@pytest.mark.parametrize('is_plain', [False, True])
def test_the_direction_of_a_disc_is_that_of_its_centroid(is_plain):
    """To the digit of OpenCV: 0 where no pixel is brighter than another."""
    image = np.random.default_rng(2).integers(0, 256, (40, 42), dtype=np.uint8)
    if is_plain:
        image[:] = 7
    half_widths = np.array([4, 4, 3, 3, 1])
    points = np.array([(x, y) for x in range(14) for y in range(12)], np.float32)
    directions = np.empty(len(points))
    kernels.disc_directions(image, 14, half_widths, points, directions)
    assert is_plain or np.unique(directions // 45).tolist() == list(range(8))
    for (x, y), found in zip(points.astype(int), directions):
        offsets = [(u, v) for v in range(-4, 5) for u in range(-half_widths[abs(v)],
                                                               half_widths[abs(v)] + 1)]
        expected = sum(np.array(offset) * int(image[14 + y + offset[1], 14 + x + offset[0]])
                       for offset in offsets)
        along_x, along_y = expected.tolist()
        assert found == cv2.fastAtan2(along_y, along_x)


def test_chosen_keypoints_are_described_as_all_are(grey):
    detector, rows = OrbDetector(FeatureSettings()), np.array([200, 3, 450, 7, 8])
    every, seen = detector.detect(grey), []

    def choose(pixels, responses):
        seen.extend((pixels, responses))
        return rows
    some = detector.detect_some(grey, choose)
    np.testing.assert_array_equal(seen[0], every.pixels)
    np.testing.assert_array_equal(seen[1], every.responses)
    for field in dataclasses.fields(some):
        np.testing.assert_array_equal(getattr(some, field.name),
                                      getattr(every, field.name)[rows])


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


@pytest.mark.parametrize('sigma', [2.0, 5.0])
def test_a_dim_image_has_weaker_corners_above_its_noise(grey, sigma):
    """At a tenth of the light: at least at 5 grey levels, and at three times the noise."""
    rng = np.random.default_rng(3)
    noise = rng.normal(0.0, sigma, grey.shape)
    dim = np.clip(40.0 + 0.15 * grey + noise, 0, 255).astype(np.uint8)
    threshold = max(5, math.ceil(3 * noise_of(dim)))
    assert 3 * noise_of(dim) == pytest.approx(3 * sigma, rel=0.15)
    found = detect(dim, min_fast_threshold=5)
    assert len(found.pixels) > 5 * len(detect(dim).pixels)
    assert sorted_rows(found) == sorted_rows(detect(dim, fast_threshold=threshold))
    assert sorted_rows(detect(dim, min_fast_threshold=20)) == sorted_rows(detect(dim))


def test_an_image_with_enough_corners_has_no_weaker_ones(grey):
    few = {'nfeatures': 100}
    assert sorted_rows(detect(grey, min_fast_threshold=1, **few)) == sorted_rows(
        detect(grey, **few))


@pytest.mark.parametrize('sigma', [1.0, 4.0, 15.0])
def test_noise_of_an_image_is_told_from_shading_and_edges(sigma):
    rows, columns = np.mgrid[:240, :320]
    image = 60.0 + 0.3 * rows + 0.2 * columns + 40.0 * (rows // 60 % 2)
    noisy = image + np.random.default_rng(4).normal(0.0, sigma, image.shape)
    assert noise_of(np.rint(noisy).astype(np.uint8)) == pytest.approx(sigma, rel=0.15)
    assert noise_of(np.zeros((2, 2), np.uint8)) == 0.0


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
