# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""SURF descriptors against direct summation over pixels."""

import cv2
import numpy as np
import pytest

from aick_ros.features.haar import describe


@pytest.fixture(scope='module')
def grey():
    rng = np.random.default_rng(2)
    return cv2.GaussianBlur(rng.integers(0, 256, (120, 160), dtype=np.uint8), (0, 0), 1.5)


def describe_by_summation(grey, pixel, scale):
    """Bay et al. 2008, 4.2, upright: a loop over samples and all pixels of their wavelets."""
    reach = 400
    wide = np.pad(grey, reach, mode='edge').astype(float)
    first = [round(place + 0.5 - 12.5 * scale) + reach for place in pixel]

    def wavelet(i, j):
        """The sample is centred on the pixel corner i (down), j (right)."""
        row, column = first[1] + (i + 1) * scale, first[0] + (j + 1) * scale
        window = wide[row - scale:row + scale, column - scale:column + scale]
        right, below = window[:, scale:].sum(), window[scale:].sum()
        return 2 * right - window.sum(), 2 * below - window.sum()

    def gauss(x, y, sigma):
        return np.exp(-(x * x + y * y) / (2 * sigma ** 2))

    parts = []
    for down in (-7.5, -2.5, 2.5, 7.5):
        for right in (-7.5, -2.5, 2.5, 7.5):
            total = np.zeros(4)
            for i in range(24):
                for j in range(24):
                    y, x = i - 11.5 - down, j - 11.5 - right
                    if max(abs(x), abs(y)) < 4.5:
                        dx, dy = np.array(wavelet(i, j)) * gauss(x, y, 2.5)
                        total += (dx, dy, abs(dx), abs(dy))
            parts.append(total * gauss(right / 5, down / 5, 1.5))
    descriptor = np.concatenate(parts)
    return descriptor / np.linalg.norm(descriptor)


@pytest.mark.parametrize('pixel, scale', [
    ((80.2, 60.3), 2.0), ((79.6, 61.2), 2.7), ((70.0, 55.0), 4.1),
    ((3.0, 118.0), 2.0), ((158.6, 2.2), 9.0)])  # the last two reach beyond the border
def test_descriptors_are_those_of_direct_summation(grey, pixel, scale):
    found = describe(grey, np.array([pixel], np.float32), np.array([scale], np.float32))
    assert found.dtype == np.float32
    np.testing.assert_allclose(
        found[0], describe_by_summation(grey, pixel, round(scale)), atol=1e-5)


def test_descriptors_do_not_depend_on_other_keypoints(grey):
    pixels = np.array([[80.2, 60.3], [3.0, 118.0], [40.4, 40.9]], np.float32)
    scales = np.array([2.0, 12.0, 3.0], np.float32)
    alone = [describe(grey, pixels[i:i + 1], scales[i:i + 1])[0] for i in range(3)]
    np.testing.assert_allclose(describe(grey, pixels, scales), alone, atol=1e-6)


def test_descriptors_are_invariant_to_brightness_and_contrast(grey):
    pixels, scales = np.array([[80.2, 60.3]], np.float32), np.array([3.0], np.float32)
    dimmed = cv2.convertScaleAbs(grey, alpha=0.5, beta=60)
    np.testing.assert_allclose(describe(dimmed, pixels, scales), describe(grey, pixels, scales),
                               atol=0.02)


def test_descriptors_without_texture_are_zero():
    flat = np.full((100, 100), 7, np.uint8)
    assert not describe(flat, np.array([[50.0, 50.0]], np.float32), np.array([2.0])).any()


def test_many_keypoints_are_described_as_few(grey):
    """More than a block of them."""
    rng = np.random.default_rng(4)
    pixels = rng.uniform((0, 0), (160, 120), (300, 2)).astype(np.float32)
    scales = rng.uniform(1.0, 6.0, 300).astype(np.float32)
    found = describe(grey, pixels, scales)
    for part in (slice(0, 1), slice(127, 130), slice(255, 300)):
        np.testing.assert_allclose(found[part], describe(grey, pixels[part], scales[part]),
                                   atol=1e-6)
    assert describe(grey, pixels[:0], scales[:0]).shape == (0, 64)


@pytest.mark.parametrize('scale', [0.0, 0.3, 0.6])
def test_the_scale_is_one_pixel_at_least(grey, scale):
    pixel = np.array([[80.2, 60.3]], np.float32)
    np.testing.assert_array_equal(describe(grey, pixel, np.array([scale])),
                                  describe(grey, pixel, np.array([1.0])))
