# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Dense projection against the projection of single points."""

import numpy as np
import pytest

from aick_ros.geometry.camera import Camera
from aick_ros.geometry.pixel_map import PixelMap

PINHOLE = Camera(640, 480, 525, 530, 319.5, 239.5)
BARREL = Camera(640, 480, 517.3, 516.5, 318.6, 255.3, 'plumb_bob', (-0.3, 0.05, -0.005, 0.003, 0))
KINECT = Camera(640, 480, 517.3, 516.5, 318.6, 255.3, 'plumb_bob',
                (0.262383, -0.953104, -0.005358, 0.002628, 1.163314))
PINCUSHION = Camera(640, 480, 517.3, 516.5, 318.6, 255.3, 'plumb_bob', (0.1, 0, 0, 0, 0))
CROPPED = Camera(640, 480, 517, 516, 90, 70, 'plumb_bob', (-0.1, 0.01, 0, 0, 0))
FISHEYE = Camera(640, 480, 300, 302, 320, 240, 'equidistant', (0.02, -0.01, 0.003, -0.001))


@pytest.mark.parametrize('camera', [PINHOLE, BARREL, KINECT, CROPPED, FISHEYE],
                         ids=['pinhole', 'barrel', 'kinect', 'cropped', 'fisheye'])
def test_pixels_agree_with_the_camera(camera):
    v, u = np.mgrid[1:479:7, 1:639:9]
    seen = camera.normalize(np.column_stack([u.ravel(), v.ravel()]))
    x, y = seen.T.reshape(2, *u.shape).astype(np.float32)
    found = np.stack(PixelMap(camera).pixels(x, y))
    np.testing.assert_allclose(found, np.stack([u, v]), atol=0.12)


def test_points_outside_of_the_field_of_view_are_not_folded_into_the_image():
    """At this angle the polynomial has passed its maximum and points back into the image."""
    camera = Camera(640, 480, 517, 517, 320, 240, 'plumb_bob', (-0.4, 0.05, 0, 0, 0))
    x = np.full((1, 1), 1.93, np.float32)
    assert abs(camera.project([(1.93, 0.0, 1.0)])[0, 0] - 320) < 300
    u, v = PixelMap(camera).pixels(x, np.zeros_like(x))
    assert np.isnan(u).all() and np.isnan(v).all()


def test_rays_beyond_the_maximum_of_the_polynomial_have_no_pixel():
    """The corners of this image see nothing, so those of the table lie beyond the maximum."""
    camera = Camera(640, 480, 517, 517, 320, 240, 'plumb_bob', (-0.4, 0.05, 0, 0, 0))
    farthest = np.sqrt((1.2 - np.sqrt(1.44 - 1.0)) / 0.5)  # where the derivative of r' is zero
    x, y = np.meshgrid(*2 * [np.linspace(-0.95, 0.95, 60, dtype=np.float32)])
    u, v = PixelMap(camera).pixels(x, y)
    beyond = np.hypot(x, y) > farthest
    assert beyond.mean() > 0.05 and np.isnan(u[beyond]).all() and np.isnan(v[beyond]).all()
    assert np.isfinite(u[np.hypot(x, y) < 0.6]).all()


@pytest.mark.parametrize('camera', [KINECT, PINCUSHION, FISHEYE],
                         ids=['kinect', 'pincushion', 'fisheye'])
@pytest.mark.parametrize('side', [0, 1])
def test_pixels_a_hundredth_beyond_the_borders_are_known_too(camera, side):
    """As many as a footprint may reach into the image from."""
    beyond = 0.01 * 640
    u, v = np.meshgrid((-beyond, 320, 639 + beyond), (-beyond, 240, 479 + beyond))
    pixels = np.column_stack([u.ravel(), v.ravel()])
    pixels = pixels[[3, 5] if side else [1, 7]]  # beside the middle of each border
    x, y = camera.normalize(pixels).astype(np.float32).T
    found = np.stack(PixelMap(camera).pixels(x[None], y[None]))[:, 0].T
    np.testing.assert_allclose(found, pixels, atol=0.12)
