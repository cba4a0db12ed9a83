# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The way of each pixel during an exposure, against the projection of its point."""

import numpy as np
import pytest

from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic.motion_blur import motion_blur, optical_flow

CAMERA = Camera(80, 60, 70.0, 55.0, 41.0, 27.0)
V, U = np.mgrid[:60, :80]
PIXELS = np.column_stack([U.ravel(), V.ravel()])


@pytest.mark.parametrize('twist', [*np.eye(6).tolist(), [0.3, -0.5, 0.2, 0.4, 0.6, -0.7]])
def test_the_flow_is_that_of_projected_points(twist):
    """Of a small motion, half of it before and half of it after the middle."""
    twist = 1e-4 * np.asarray(twist)
    depth = np.random.default_rng(0).uniform(0.5, 4.0, (60, 80)).astype(np.float32)
    points = CAMERA.back_project(PIXELS, depth.ravel())
    start, end = (CAMERA.project(se3.transform(se3.exp(half), points))
                  for half in (0.5 * twist, -0.5 * twist))
    flow = np.stack(np.broadcast_arrays(
        *optical_flow(depth, CAMERA, twist.astype(np.float32))), -1)
    np.testing.assert_allclose(flow.reshape(-1, 2), end - start, atol=2e-6)
    assert np.abs(flow).max() > 1e-3


def picture():
    return np.random.default_rng(1).integers(0, 256, (60, 80, 3), np.uint8)


def test_what_moves_by_less_than_a_pixel_is_sharp():
    image, depth = picture(), np.full((60, 80), 1.0, np.float32)
    for sideways in (0.0, 0.99 / 70):
        assert motion_blur(image, depth, CAMERA, se3.exp([sideways, 0, 0, 0, 0, 0])) is image
    assert motion_blur(image, depth, CAMERA, se3.exp([1.01 / 70, 0, 0, 0, 0, 0])) is not image


@pytest.mark.parametrize('length, taps', [(2, 2), (4, 4), (9, 9), (18, 9)])
@pytest.mark.parametrize('axis', [0, 1])
def test_a_sideways_motion_is_the_mean_along_its_way(axis, length, taps):
    image, depth = picture(), np.full((60, 80), 2.0, np.float32)
    focal = (70.0, 55.0)[axis]
    twist = np.zeros(6)
    twist[axis] = -2.0 * length / focal
    blurred = motion_blur(image, depth, CAMERA, se3.exp(twist))
    # linear between pixels, at places spread evenly over the way
    along = np.arange(image.shape[1 - axis])
    moved = np.moveaxis(image, 1 - axis, 0).astype(float)
    places = along[:, None] + ((np.arange(taps) + 0.5) / taps - 0.5) * length
    below = np.floor(places).astype(int)
    share = (places - below)[..., None, None]
    last = len(along) - 1
    values = (1 - share) * moved[below.clip(0, last)] + share * moved[(below + 1).clip(0, last)]
    expected = np.moveaxis(values.mean(axis=1), 0, 1 - axis)
    np.testing.assert_allclose(blurred, expected, atol=2.0)


def test_what_is_nowhere_moves_by_the_rotation_alone():
    image, far = picture(), np.full((60, 80), np.nan, np.float32)
    motion = se3.exp([0.5, 0.2, 0.1, 0.0, 0.06, 0.0])
    turn = se3.exp([0, 0, 0, 0.0, 0.06, 0.0])
    endless = np.full((60, 80), 1e9, np.float32)
    np.testing.assert_array_equal(motion_blur(image, far, CAMERA, motion),
                                  motion_blur(image, endless, CAMERA, turn))
    assert (motion_blur(image, far, CAMERA, motion) != image).any()
