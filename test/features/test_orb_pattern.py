# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Descriptors of ORB are those of OpenCV, whatever makes them."""

import cv2
import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.features import orb_pattern
from aick_ros.features.mirrored_border import with_border

PATCH_SIZES = [5, 6, 15, 30, 31, 61, 101]


def opencv(image, patch_size, points, directions):
    keypoints = [cv2.KeyPoint(x, y, patch_size, direction)
                 for (x, y), direction in zip(points.tolist(), directions.tolist())]
    return cv2.ORB_create(nlevels=1, edgeThreshold=0, WTA_K=2, patchSize=patch_size).compute(
        image, keypoints)[1]


def described(image, patch_size, points, directions):
    border = orb_pattern.least_border(patch_size)
    return orb_pattern.describe(with_border(image, border), border, patch_size, points,
                                directions)


@pytest.fixture
def no_patterns():
    """Forget what was measured, before and after a test."""
    orb_pattern.pattern.cache_clear()
    yield
    orb_pattern.pattern.cache_clear()


@pytest.mark.parametrize('patch_size', PATCH_SIZES)
def test_descriptors_are_those_of_opencv(patch_size):
    """Of images of any size, in any direction, and where patches reach beyond the image."""
    rng = np.random.default_rng(patch_size)
    for number in range(30):
        height, width = rng.integers(2, 150, 2)
        image = rng.integers(0, 256, (height, width), dtype=np.uint8)
        if number % 2:
            image = cv2.blur(image, (5, 5)).reshape(image.shape)
        points = np.float32(rng.integers((0, 0), (width, height), (200, 2)))
        directions = np.float32(rng.uniform(0, 360, 200)).astype(float)
        directions[:9] = 45 * np.arange(9)
        np.testing.assert_array_equal(described(image, patch_size, points, directions),
                                      opencv(image, patch_size, points, directions))


@pytest.mark.parametrize('patch_size', PATCH_SIZES)
def test_patterns_are_measured_and_tell_how_sums_are_rounded(patch_size, no_patterns, monkeypatch):
    found = orb_pattern.pattern(patch_size)
    assert np.abs(found.coordinates).max() in (patch_size // 2, 13)
    assert len(np.unique(found.coordinates.T, axis=0)) > 150
    with monkeypatch.context() as patch:  # an OpenCV that rounds in the other way
        patch.setattr(orb_pattern, '_by_opencv', lambda image, size, points, directions: (
            orb_pattern._by_kernel(with_border(image, 80), 80, other, points,
                                   directions)))
        patch.setattr(orb_pattern, '_coordinates', lambda size: found.coordinates)
        for fused in (False, True):
            orb_pattern.pattern.cache_clear()
            other = orb_pattern.Pattern(found.coordinates, fused)
            assert orb_pattern.pattern(patch_size).fused == fused


def test_where_the_pattern_is_not_that_of_opencv_it_describes(no_patterns, monkeypatch):
    wrong = orb_pattern.pattern(31).coordinates.copy()
    wrong[0, 100] += 1
    monkeypatch.setattr(orb_pattern, '_coordinates', lambda size: wrong)
    orb_pattern.pattern.cache_clear()
    assert orb_pattern.pattern(31) is None
    monkeypatch.setattr(orb_pattern, '_by_kernel', None)
    rng = np.random.default_rng(0)
    image = rng.integers(0, 256, (60, 80), dtype=np.uint8)
    points, directions = np.float32(rng.integers(0, 60, (50, 2))), np.linspace(0, 360, 50)
    np.testing.assert_array_equal(described(image, 31, points, directions),
                                  opencv(image, 31, points, directions))


def pattern_with(number=4.0):
    """Return a pattern with an own number in its last row."""
    coordinates = np.zeros((4, 256), np.float32)
    coordinates[3, 200] = number
    return coordinates


@pytest.mark.parametrize('wrong', [
    {'point': (-1, 0)}, {'point': (30, 0)}, {'point': (0, 20)}, {'point': (np.nan, 0)},
    {'point': (0, np.inf)}, {'point': (29.4, 0)}, {'direction': np.nan}, {'direction': np.inf},
    {'direction': 1e9}, {'number': np.nan}, {'number': np.inf}, {'number': 24.5},
    {'number': -1e30}, {'border': 19}, {'border': 33}], ids=str)
def test_what_lies_beyond_the_image_is_not_compared(wrong):
    def describe(point=(29, 19), direction=45.0, number=24.4, border=24):
        descriptors = np.empty((1, 32), np.uint8)
        kernels.describe_points(np.zeros((68, 78), np.uint8), border, pattern_with(number), True,
                                np.float32([point]), np.array([direction]), descriptors)
    describe()
    with pytest.raises(ValueError):
        describe(**wrong)


def test_images_so_wide_that_places_overflow_are_refused():
    image = np.zeros((42, 2 ** 20 + 1), np.uint8)
    with pytest.raises(ValueError, match='not within the image'):
        kernels.describe_points(image, 20, pattern_with(), True, np.zeros((1, 2), np.float32),
                                np.zeros(1), np.empty((1, 32), np.uint8))


@pytest.mark.parametrize('fused', [False, True])
@pytest.mark.parametrize('shape', [(1, 1), (2, 9), (40, 16), (50, 55)])
def test_the_image_is_blurred_around_the_points_only(shape, fused):
    rng = np.random.default_rng(0)
    bordered = rng.integers(0, 256, np.add(shape, 44), dtype=np.uint8)
    before, inner = bordered.copy(), np.zeros(bordered.shape, bool)
    inner[22:-22, 22:-22] = True
    kernels.describe_points(bordered, 22, pattern_with(), fused, np.zeros((1, 2), np.float32),
                            np.zeros(1), np.empty((1, 32), np.uint8))
    assert (bordered == before)[~inner].all()
    near = np.s_[22:22 + 5, 22:22 + 5]
    weights = cv2.getGaussianKernel(7, 2)
    blurred = cv2.sepFilter2D(before.astype(float), -1, weights, weights)
    assert np.abs(bordered - blurred)[inner & (bordered != before)].max() <= 0.5 + 1e-4
    assert np.abs(bordered - blurred)[near][inner[near]].max() <= 0.5 + 1e-4
    assert shape[1] < 40 or (bordered == before)[22 + 5:, :].all()
