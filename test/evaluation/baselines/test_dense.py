# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Clouds and undistorted images against OpenCV and against the renderer's exact geometry."""

import cv2
import numpy as np
import pytest

from aick_ros.evaluation.baselines.dense import point_cloud
from aick_ros.frames.rectification import rectified
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

CAMERA = Camera(160, 120, 130.0, 128.0, 80.2, 59.1, 'plumb_bob', (0.1, -0.05, 0.002, -0.001))


@pytest.fixture
def frame():
    rng = np.random.default_rng(1)
    colour = cv2.GaussianBlur(rng.integers(0, 255, (120, 160, 3), np.uint8), (0, 0), 3)
    depth = rng.uniform(0.5, 6.0, (120, 160)).astype(np.float32)
    depth[rng.random((120, 160)) < 0.2] = np.nan
    return RgbdFrame(1, colour, depth, CAMERA)


def test_points_project_onto_their_pixels(frame):
    points = point_cloud(frame, 4.0)
    pixels = CAMERA.project(points)
    assert np.abs(pixels - pixels.round()).max() < 1e-3
    u, v = pixels.round().astype(int).T
    np.testing.assert_allclose(points[:, 2], frame.depth[v, u])
    with np.errstate(invalid='ignore'):
        assert len(points) == np.sum(frame.depth < 4.0)


def test_undistorts_as_opencv_does(frame):
    colour, depth = rectified(frame).colour, rectified(frame).depth
    expected = cv2.undistort(frame.colour, CAMERA.matrix, np.array(CAMERA.distortion))
    inside = np.s_[8:-8, 8:-8]
    assert np.abs(colour[inside].astype(int) - expected[inside]).max() <= 2
    found = depth[inside]
    assert np.isin(found[np.isfinite(found)], frame.depth).all()  # none between two surfaces
    assert 0.75 < np.isfinite(found).mean() < 0.85


def test_leaves_the_images_of_an_ideal_camera_alone(frame):
    ideal = RgbdFrame(1, frame.colour, frame.depth, Camera(160, 120, 130.0, 128.0, 80.2, 59.1))
    colour, depth = rectified(ideal).colour, rectified(ideal).depth
    assert colour is ideal.colour
    assert depth is ideal.depth
