# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Rectified frames against OpenCV's undistortion, and against where points are seen."""

import dataclasses

import cv2
import numpy as np
import pytest

from aick_ros.frames.rectification import rectified, rectified_pixels
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

PLUMB_BOB = Camera(160, 120, 130.0, 132.0, 78.0, 61.0, 'plumb_bob',
                   (-0.3, 0.1, 0.002, -0.001, 0.0))
FISHEYE = Camera(160, 120, 90.0, 91.0, 78.0, 61.0, 'equidistant', (0.02, -0.01, 0.003, 0.0))
EDGE = 3  # px


def frame_of(camera, colour):
    """A frame whose depth, like its colour, differs from pixel to pixel."""
    v, u = np.mgrid[:camera.height, :camera.width].astype(np.float32)
    return RgbdFrame(7, colour, 1.0 + 0.01 * u + 0.02 * v, camera, depth_stamp=9)


@pytest.fixture(scope='module')
def colour():
    noise = np.random.default_rng(1).integers(0, 256, (30, 40, 3), np.uint8)
    return cv2.resize(noise, (160, 120), interpolation=cv2.INTER_CUBIC)


def test_it_is_the_undistortion_of_opencv(colour):
    frame = frame_of(PLUMB_BOB, colour)
    result = rectified(frame)
    expected = cv2.undistort(colour, PLUMB_BOB.matrix, np.array(PLUMB_BOB.distortion))
    inside = np.s_[EDGE:-EDGE, EDGE:-EDGE]
    difference = np.abs(result.colour[inside].astype(int) - expected[inside])
    assert np.percentile(difference, 99) <= 6
    assert difference.mean() < 1.0
    unchanged = np.abs(colour[inside].astype(int) - expected[inside])
    assert unchanged.mean() > 10.0  # there is something to undo
    assert (result.stamp, result.depth_stamp) == (7, 9)


@pytest.mark.parametrize('camera', [PLUMB_BOB, FISHEYE])
def test_at_an_edge_no_depth_lies_between_two_surfaces(colour, camera):
    near = np.random.default_rng(2).random((120, 160)) < 0.5
    frame = dataclasses.replace(
        frame_of(camera, colour), depth=np.where(near, 1.0, 3.0).astype(np.float32))
    depth = rectified(frame).depth
    assert set(depth[np.isfinite(depth)].tolist()) == {1.0, 3.0}


@pytest.mark.parametrize('camera', [PLUMB_BOB, FISHEYE])
def test_each_pixel_has_the_depth_of_its_ray(colour, camera):
    frame = frame_of(camera, colour)
    result = rectified(frame)
    assert result.camera.distortion == ()
    v, u = np.mgrid[:camera.height, :camera.width]
    rays = np.column_stack([(u.ravel() - camera.cx) / camera.fx,
                            (v.ravel() - camera.cy) / camera.fy, np.ones(u.size)])
    seen = camera.project(rays).T.reshape(2, *u.shape)
    inside = ((seen >= EDGE) & (seen <= np.reshape([camera.width, camera.height], (2, 1, 1))
                                - 1 - EDGE)).all(axis=0)
    assert inside.mean() > 0.5
    expected = 1.0 + 0.01 * seen[0] + 0.02 * seen[1]
    # half a pixel to the nearest one, and 0.12 px of the map
    assert np.abs(result.depth - expected)[inside].max() <= 0.03 * (0.5 + 0.12)


def test_what_the_camera_has_not_seen_has_no_depth(colour):
    camera = Camera(160, 120, 130.0, 132.0, 78.0, 61.0, 'plumb_bob', (0.4, 0.0, 0.0, 0.0, 0.0))
    result = rectified(frame_of(camera, np.full_like(colour, 200)))
    corner = result.depth[0, 0], *result.colour[0, 0]
    assert np.isnan(corner[0])
    assert corner[1:] == (0, 0, 0)


def test_without_distortion_nothing_is_done(colour):
    frame = frame_of(Camera(160, 120, 130.0, 132.0, 78.0, 61.0), colour[..., 0].copy())
    assert rectified(frame) is frame


@pytest.mark.parametrize('camera', [PLUMB_BOB, FISHEYE])
def test_pixels_lie_where_the_camera_without_distortion_sees_their_points(camera):
    points = np.random.default_rng(3).uniform((-0.4, -0.3, 1.0), (0.4, 0.3, 2.0), (50, 3))
    pinhole = dataclasses.replace(camera, distortion=(), distortion_model='plumb_bob')
    np.testing.assert_allclose(rectified_pixels(camera, camera.project(points)),
                               pinhole.project(points), atol=1e-3)
    np.testing.assert_array_equal(rectified_pixels(pinhole, pinhole.project(points)),
                                  pinhole.project(points))


def test_each_camera_has_its_own_map(colour):
    """One after the other, as those of two recordings."""
    first = rectified(frame_of(PLUMB_BOB, colour)).depth
    other = rectified(frame_of(FISHEYE, colour))
    assert other.camera == dataclasses.replace(FISHEYE, distortion=(),
                                               distortion_model='plumb_bob')
    assert np.nanmedian(np.abs(other.depth - first)) > 0.01
    np.testing.assert_array_equal(rectified(frame_of(PLUMB_BOB, colour)).depth, first)


def test_rays_that_the_model_folds_back_into_the_image_are_not_seen():
    """Beyond the largest radius that the polynomial has, in closed form."""
    camera = Camera(160, 120, 75.0, 75.0, 79.5, 59.5, 'plumb_bob', (-0.4, 0.05, 0.0, 0.0, 0.0))
    colour = np.full((120, 160, 3), 200, np.uint8)
    result = rectified(frame_of(camera, colour))
    v, u = np.mgrid[:120, :160]
    radius = np.hypot(u - 79.5, v - 59.5) / 75.0
    largest = np.sqrt((1.2 - np.sqrt(1.44 - 1.0)) / 0.5)  # where the derivative of r' is zero
    folded = radius > largest
    assert folded.mean() > 0.05
    assert np.isnan(result.depth[folded]).all() and not result.colour[folded].any()
    assert np.isfinite(result.depth[radius < 0.75]).all()
