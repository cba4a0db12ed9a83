# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Windows around keypoints: their planes, how they are stretched, and where they are found."""

import dataclasses

import cv2
import numpy as np
import pytest

from aick_ros.frames.depth import position_covariances
from aick_ros.frames.keypoints import KeypointExtractor, KeypointFrame
from aick_ros.frames.prepared import PreparedFrame
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.registration.refinement.lucas_kanade import not_turned
from aick_ros.registration.refinement.tracks import Tracker
from aick_ros.registration.refinement.windows import Windows, gradient_moments, jacobians, planes
from aick_ros.settings import Settings

CAMERA = Camera(320, 240, 270.0, 250.0, 159.5, 119.5)
SETTINGS = Settings()
PLANE = np.array([0.35, 0.1, 0.3])  # n . p = 1
MOTION = se3.exp(np.array([0.02, -0.01, 0.12, 0.01, -0.02, 0.015]))  # T_target_source
WINDOW = 9


def rays(pixels):
    return np.column_stack([CAMERA.normalize(pixels), np.ones(len(pixels))])


def points_at(pixels):
    """Return where pixels see the plane, Nx3."""
    return rays(pixels) / (rays(pixels) @ PLANE)[:, None]


def depth_image():
    v, u = np.mgrid[:CAMERA.height, :CAMERA.width]
    z = points_at(np.column_stack([u.ravel(), v.ravel()]).astype(float))[:, 2]
    return np.where(z > 0, z, np.nan).reshape(u.shape).astype(np.float32)


PIXELS = np.random.default_rng(0).uniform((60, 20), (300, 220), (50, 2)).round()


def test_planes_of_windows():
    points = points_at(PIXELS)
    found = planes(depth_image(), PIXELS, points, CAMERA, WINDOW)
    np.testing.assert_allclose(found, np.tile(PLANE, (50, 1)), atol=1e-4)


def test_of_a_curved_surface_a_window_has_the_tangent_plane_at_its_centre():
    """Inverse depths are quadratic in the pixels: their mean slope is that of the centre."""
    def inverse(u, v):
        return 0.6 + 1e-3 * u - 5e-4 * v + 4e-6 * (u - 90) ** 2 - 6e-6 * u * v + 2e-6 * v ** 2

    v, u = np.mgrid[:CAMERA.height, :CAMERA.width]
    points = rays(PIXELS) / inverse(*PIXELS.T)[:, None]
    found = planes((1 / inverse(u, v)).astype(np.float32), PIXELS, points, CAMERA, WINDOW)
    u, v = PIXELS.T
    slopes = np.column_stack([CAMERA.fx * (1e-3 + 8e-6 * (u - 90) - 6e-6 * v),
                              CAMERA.fy * (-5e-4 - 6e-6 * u + 4e-6 * v)])
    np.testing.assert_allclose(found[:, :2], slopes, atol=1e-4)
    np.testing.assert_allclose(np.einsum('ij,ij->i', found, points), 1.0, atol=1e-9)


def test_without_depth_a_window_faces_the_camera():
    points = points_at(PIXELS)
    found = planes(np.full((240, 320), np.nan, np.float32), PIXELS, points, CAMERA, WINDOW)
    np.testing.assert_allclose(found, np.outer(1 / points[:, 2], [0, 0, 1]), atol=1e-9)


@pytest.mark.parametrize('depth', [0.0, 1e-45, 1e-39])
def test_depths_that_cannot_be_count_as_none(depth):
    """Their reciprocals would be infinite, and NumPy warn of them."""
    points, image = points_at(PIXELS), depth_image()
    image[:, ::2] = depth
    expected = np.where(image == np.float32(depth), np.nan, image)
    with np.errstate(all='raise'):
        found = planes(image, PIXELS, points, CAMERA, WINDOW)
    np.testing.assert_array_equal(found, planes(expected, PIXELS, points, CAMERA, WINDOW))


def test_jacobians_are_the_derivatives_of_where_a_plane_is_seen():
    """By differences."""
    found = jacobians(np.tile(PLANE, (50, 1)), points_at(PIXELS), CAMERA, MOTION)

    def seen(pixels):
        return CAMERA.project(se3.transform(MOTION, points_at(pixels)))

    for i, step in enumerate(0.01 * np.eye(2)):
        slope = (seen(PIXELS + step) - seen(PIXELS - step)) / 0.02
        np.testing.assert_allclose(found[:, :, i], slope, atol=1e-5)


@pytest.mark.parametrize('turn', [np.eye(3), se3.exp_rotation((0.1, 0.2, 0.3))])
def test_the_shift_is_the_weighted_mean_of_the_displacements(turn):
    """Pixel by pixel, in the turned image."""
    rng = np.random.default_rng(1)
    grey = cv2.GaussianBlur(rng.integers(0, 256, (240, 320), np.uint8), (5, 5), 1.0)
    points, normals = points_at(PIXELS), np.tile(PLANE, (50, 1))
    windows = Windows(points, np.ones(50), normals, gradient_moments(grey, PIXELS, WINDOW))
    turned = np.eye(4)
    turned[:3, :3] = turn
    turns = jacobians(normals, points, CAMERA, turned)
    shifts = windows.shifts(CAMERA, MOTION, turns)
    for centre, by_turn, moved, shift in zip(
            PIXELS.astype(int), turns, jacobians(normals, points, CAMERA, MOTION), shifts):
        matrix, right = np.zeros((2, 2)), np.zeros(2)
        for offset in np.ndindex(WINDOW, WINDOW):
            offset = np.array(offset) - WINDOW // 2
            u, v = centre + offset
            gradient = np.linalg.solve(by_turn.T, [float(grey[v, u + 1]) - grey[v, u - 1],
                                                   float(grey[v + 1, u]) - grey[v - 1, u]])
            matrix += np.outer(gradient, gradient)
            right += gradient * (gradient @ ((moved - by_turn) @ offset))
        np.testing.assert_allclose(shift, np.linalg.solve(matrix, right), rtol=1e-4, atol=1e-6)


def view(grey, depth):
    """Return a prepared frame of a grey image and its depth."""
    frame = RgbdFrame(0, np.dstack(3 * [grey]), depth, CAMERA)
    extractor = KeypointExtractor(SETTINGS.features, SETTINGS.sensor)
    return PreparedFrame(frame, extractor.extract(frame), grey)


def pattern():
    """Return a grey image to be tracked in."""
    return cv2.resize(np.random.default_rng(2).integers(0, 256, (60, 80), np.uint8), (320, 240),
                      interpolation=cv2.INTER_CUBIC)


def test_no_windows_and_windows_without_gradient():
    windows = Windows.of(view(pattern(), depth_image()), np.empty(0, int), WINDOW)
    assert windows.shifts(CAMERA, MOTION, not_turned(0)).shape == (0, 2)
    flat = Windows(points_at(PIXELS), np.ones(50), np.tile(PLANE, (50, 1)),
                   gradient_moments(np.full((240, 320), 7, np.uint8), PIXELS, WINDOW))
    np.testing.assert_array_equal(flat.shifts(CAMERA, MOTION, not_turned(50)), np.zeros((50, 2)))


def test_windows_of_an_image_that_is_smaller_than_they_are():
    grey, depth = pattern()[:10], np.full((10, 320), 1.5, np.float32)
    frame = RgbdFrame(0, np.dstack(3 * [grey]), depth, dataclasses.replace(CAMERA, height=10))
    keypoints = view(pattern(), depth_image()).keypoints
    inside = np.flatnonzero(keypoints.pixels[:, 1] < 9)
    windows = Windows.of(PreparedFrame(frame, keypoints, grey), inside, 31)
    assert len(windows.points) == len(inside) > 0
    assert np.isfinite(windows.shifts(CAMERA, MOTION, not_turned(len(inside)))).all()


@pytest.fixture
def edged():
    """Return a frame of two surfaces, at 1 and at 2 m, with keypoints on and beside the edge."""
    depth = np.full((240, 320), 2.0, np.float32)
    depth[:, :160] = 1.0
    u, v = np.meshgrid([100.0, 152.0, 158.0, 161.0, 168.0, 220.0], np.arange(20.0, 221.0, 10.0))
    pixels = np.column_stack([u.ravel(), v.ravel()])
    positions = CAMERA.back_project(pixels, np.where(pixels[:, 0] < 160, 1.0, 2.0))
    keypoints = KeypointFrame(
        0, positions.astype(np.float32), np.zeros((len(u.ravel()), 32), np.uint8),
        position_covariances(positions, np.ones(len(positions)), CAMERA,
                             SETTINGS.sensor).astype(np.float32), pixels.astype(np.float32))
    grey = pattern()
    return PreparedFrame(RgbdFrame(0, grey, depth, CAMERA), keypoints, grey)


def test_a_window_on_an_edge_is_where_the_nearer_surface_is(edged):
    """And is not taken for slanted."""
    windows = Windows.of(edged, np.arange(len(edged.keypoints)), WINDOW)
    positions, u = edged.keypoints.positions, edged.keypoints.pixels[:, 0]
    beside = u == 161.0
    np.testing.assert_allclose(windows.points[beside, 2], 1.0)
    np.testing.assert_allclose(windows.points[beside] * 2.0, positions[beside], rtol=1e-6)
    np.testing.assert_allclose(windows.points[~beside], positions[~beside])
    # a quarter of the step of inverse depth besides
    variances = SETTINGS.sensor.depth_sigma ** 2 + beside * (0.25 * 0.5) ** 2
    np.testing.assert_allclose(windows.sigmas ** 2, variances, rtol=1e-3)
    on_edge = beside | (u == 158.0)
    assert not windows.moments[on_edge, 1:].any()
    assert windows.moments[~on_edge, 1:].any(axis=(1, 2)).all()


def test_tracked_back_a_window_on_an_edge_is_as_uncertain(edged):
    """From the frame to itself: points are those of the keypoints, with their sigmas."""
    tracks = Tracker(SETTINGS.refinement, SETTINGS.sensor).track_back(edged, edged, np.eye(4))
    windows = Windows.of(edged, tracks.keypoints, WINDOW)
    u = edged.keypoints.pixels[tracks.keypoints, 0]
    assert len(tracks) > 0.8 * len(edged.keypoints)
    np.testing.assert_allclose(tracks.sigmas, windows.sigmas, rtol=1e-3)
    assert (tracks.sigmas[u == 161.0] > 0.12).all() and np.count_nonzero(u == 161.0) > 3
    np.testing.assert_allclose(tracks.rays, windows.points[:, :2] / windows.points[:, 2:])
    np.testing.assert_allclose(tracks.depths, windows.points[:, 2])
    np.testing.assert_allclose(tracks.points[u != 161.0], windows.points[u != 161.0], atol=1e-3)


@pytest.mark.parametrize('roll', [0.0, 0.2])
def test_keypoints_of_a_slanted_wall_are_tracked_more_exactly(monkeypatch, roll):
    """A picture on a wall that is passed: the homography of its plane is what is seen."""
    motion = se3.exp(np.array([0, 0, 0, 0, 0, roll])) @ MOTION
    homography = CAMERA.matrix @ (motion[:3, :3] + np.outer(motion[:3, 3], PLANE)) @ (
        np.linalg.inv(CAMERA.matrix))
    source = view(pattern(), depth_image())
    target = view(cv2.warpPerspective(source.grey, homography, (320, 240),
                                      flags=cv2.INTER_CUBIC), depth_image())

    def error():
        tracks = Tracker(SETTINGS.refinement, SETTINGS.sensor).track(source, target, motion)
        true = CAMERA.project(se3.transform(motion, tracks.points))
        seen = CAMERA.project(np.column_stack([tracks.rays, np.ones(len(tracks))]))
        assert len(tracks) > 80
        return np.median(np.linalg.norm(seen - true, axis=1))

    with_slant = error()
    monkeypatch.setattr(Windows, 'shifts', lambda self, *_: np.zeros((len(self.points), 2)))
    assert with_slant < 0.6 * error()


@pytest.mark.parametrize('beyond', [0, 1, 3])
def test_a_window_beside_the_border_is_the_last_that_fits(beyond):
    """As in a larger image, of which the one with the border shows a part."""
    larger = np.random.default_rng(3).integers(0, 256, (60, 80), np.uint8)
    # with its gradients a window of 7 pixels reaches 4 pixels around its centre
    fitting = np.array([(25, 4), (25, 35), (4, 20), (45, 20), (45, 35), (4, 4)], float)
    sides = np.array([(0, -1), (0, 1), (-1, 0), (1, 0), (1, 1), (-1, -1)])
    np.testing.assert_array_equal(
        gradient_moments(larger[10:50, 10:60].copy(), fitting + beyond * sides, 7),
        gradient_moments(larger, fitting + 10.0, 7))
