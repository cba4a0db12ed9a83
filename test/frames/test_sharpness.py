# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Blur against what looks like it: other contrast, noise, a view with little on it."""

import cv2
import numpy as np
import pytest
from scipy import ndimage

from aick_ros import kernels
from aick_ros.features.mirrored_border import with_border
from aick_ros.frames.sharpness import Sharpness


@pytest.fixture(scope='module')
def image():
    """Return a picture of patches of random size and brightness, with noise of the sensor."""
    rng = np.random.default_rng(0)
    picture = np.full((240, 320), 90.0)
    for _ in range(400):
        u, v, size = rng.integers((320, 240, 30))
        picture[v:v + size, u:u + size] = rng.uniform(20, 230)
    return picture


def sharpness(picture, noise=1.5):
    noisy = picture + noise * np.random.default_rng(1).standard_normal(picture.shape)
    return Sharpness.of(np.clip(np.rint(noisy), 0, 255).astype(np.uint8))


@pytest.mark.parametrize('sigma, is_blurred', [(0.7, False), (3.0, True), (6.0, True)])
def test_gaussian_blur(image, sigma, is_blurred):
    blurred = cv2.GaussianBlur(image, (0, 0), sigma)
    assert sharpness(blurred).is_blurred_beside(sharpness(image)) == is_blurred


@pytest.mark.parametrize('width, is_blurred', [(3, False), (45, True)])
def test_motion_blur(image, width, is_blurred):
    diagonal = np.eye(width) / width
    smeared = cv2.filter2D(image, -1, diagonal)
    assert sharpness(smeared).is_blurred_beside(sharpness(image)) == is_blurred


@pytest.mark.parametrize('other', [
    lambda image: 90 + 0.2 * (image - 90), lambda image: np.full_like(image, 90.0),
    lambda image: np.where(np.arange(320) < 290, 90.0, image)],
    ids=['low contrast', 'blank', 'little to see'])
def test_what_is_not_blurred(image, other):
    assert not sharpness(other(image)).is_blurred_beside(sharpness(image))


def test_a_sharp_image_is_not_blurred_beside_a_blurred_one(image):
    blurred = cv2.GaussianBlur(image, (0, 0), 4.0)
    assert not sharpness(image).is_blurred_beside(sharpness(blurred))


def test_it_is_the_root_mean_square_of_laplacian_and_gradient():
    """By SciPy's filters, on an image whose half is known and whose axes differ."""
    rng = np.random.default_rng(4)
    half = np.tile(rng.integers(60, 190, (1, 40)), (30, 1)) + rng.integers(-20, 21, (30, 40))
    found = Sharpness.of(np.kron(half, np.ones((2, 2))).astype(np.uint8))
    laplacian = ndimage.laplace(half.astype(float), mode='mirror')
    gradient = [ndimage.sobel(half.astype(float), axis, mode='mirror') for axis in (0, 1)]
    detail = np.sqrt(np.mean(laplacian ** 2))
    assert found.detail == pytest.approx(detail, rel=1e-9)
    assert found.fineness == pytest.approx(
        detail / np.sqrt(np.mean(gradient[0] ** 2 + gradient[1] ** 2)), rel=1e-9)


@pytest.mark.parametrize('detail, fineness, is_blurred', [
    (2.999, 0.7499, True), (3.0, 0.7499, False), (2.999, 0.75, False), (0.0, 1.0, False),
    (100.0, 0.0, False)])
def test_blur_takes_seven_tenths_of_the_detail_and_a_quarter_of_the_fineness(
        detail, fineness, is_blurred):
    assert Sharpness(detail, fineness).is_blurred_beside(Sharpness(10.0, 1.0)) == is_blurred


@pytest.mark.parametrize('height, width', [(2, 3), (5, 256), (7, 257), (40, 700)])
def test_squares_of_derivatives_are_those_of_opencv(height, width):
    image = np.random.default_rng(width).integers(0, 256, (height, width), np.uint8)
    image[:2, :3] = 255, 0, 255
    laplacian = cv2.Laplacian(image, cv2.CV_64F)
    gradient = [cv2.Sobel(image, cv2.CV_64F, *order) for order in ((1, 0), (0, 1))]
    assert kernels.derivative_squares(with_border(image, 1)) == (
        np.square(laplacian).sum(), np.square(gradient).sum())


def test_an_image_without_a_border_has_no_derivatives_there():
    with pytest.raises(ValueError, match='border'):
        kernels.derivative_squares(np.zeros((1, 9), np.uint8))
