# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Windows around keypoints: their relief, how they are stretched, and where they are found."""

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
from aick_ros.registration.refinement.tracker import Tracker
from aick_ros.registration.refinement.windows import (
    Windows, gradient_moments, reliefs_of, warps_of)
from aick_ros.settings import SensorSettings, Settings

CAMERA = Camera(320, 240, 270.0, 250.0, 159.5, 119.5)
SETTINGS = Settings()
PLANE = np.array([0.35, 0.1, 0.3])  # n . p = 1
MOTION = se3.exp(np.array([0.02, -0.01, 0.12, 0.01, -0.02, 0.015]))  # T_target_source
WINDOW = 9
SLOPES = PLANE[:2] / (CAMERA.fx, CAMERA.fy)  # of the inverse depth of the plane [1/m px]


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


def depths_at(pixels):
    return points_at(pixels)[:, 2].copy()


def reliefs(grey, image, depths=None):
    return reliefs_of(grey, image, PIXELS, depths_at(PIXELS) if depths is None else depths,
                      WINDOW, SETTINGS.sensor)[1]


def slopes(image, pixels=PIXELS):
    return reliefs_of(noise(0), image, pixels, depths_at(pixels), WINDOW, SETTINGS.sensor)[2]


def noise(seed):
    return cv2.GaussianBlur(np.random.default_rng(seed).integers(0, 256, (240, 320), np.uint8),
                            (5, 5), 1.0)


def gradient_at(grey, u, v):
    return np.array([float(grey[v, u + 1]) - grey[v, u - 1],
                     float(grey[v + 1, u]) - grey[v - 1, u]])


def test_reliefs_are_sums_over_pixels():
    """Pixel by pixel: a gradient is on the nearest of five, where there is a step between them."""
    rng = np.random.default_rng(5)
    grey, z = noise(6), np.full(50, 2.0)
    inverse = rng.choice([0.5, 0.505, 0.52, 0.54, 0.56, 0.47, 0.44, np.nan], (240, 320))
    of_all, near, _ = reliefs_of(grey, (1 / inverse).astype(np.float32), PIXELS, z, WINDOW,
                                 SETTINGS.sensor)
    least_step, most = 8 * SETTINGS.sensor.depth_sigma, 0.1 * 0.5
    for (u, v), *found in zip(PIXELS.astype(int), of_all, near):
        expected = np.zeros((2, 3))
        for row in range(v - 4, v + 5):
            for column in range(u - 4, u + 5):
                own, *others = np.nan_to_num(
                    [inverse[row, column], inverse[row, column - 1], inverse[row, column + 1],
                     inverse[row - 1, column], inverse[row + 1, column]], nan=-np.inf)
                nearest = max(own, *others)
                owner = nearest if nearest > own + least_step else own
                nearer = owner - 0.5 if np.isfinite(owner) else 0.0
                by_u, by_v = gradient_at(grey, column, row)
                products = nearer * np.array([by_u * by_u, by_u * by_v, by_v * by_v])
                expected += products, (abs(nearer) < most) * products
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=0.01)


def test_a_step_is_one_that_the_noise_of_the_depth_does_not_make():
    """Of a sensor whose noise of the inverse depth falls with the distance."""
    sensor = SensorSettings(depth_sigma=0.001, depth_exponent=1.0)  # 0.0005/m at 2 m
    grey = noise(7)
    for step, is_one in ((0.0038, False), (0.0042, True)):
        inverse = np.full((240, 320), 0.5)
        inverse[:, 160:] += step
        _, found, _ = reliefs_of(grey, (1 / inverse).astype(np.float32),
                                 np.array([(160.0, 120.0)]), np.array([2.0]), WINDOW, sensor)
        nearer = [(u, v) for v in range(116, 125) for u in range(159 if is_one else 160, 165)]
        expected = step * sum(gradient_at(grey, u, v)[0] ** 2 for u, v in nearer)
        np.testing.assert_allclose(found[0, 0], expected, rtol=1e-3)


@pytest.mark.parametrize('depth', [np.nan, 0.0, 1e-45, 1e-39, np.inf])
def test_without_depth_a_window_is_as_far_as_its_centre(depth):
    """Reciprocals of depths that cannot be would be infinite, and NumPy warn of them."""
    depths = np.full((240, 320), depth).astype(np.float32)
    with np.errstate(all='raise'):
        found = reliefs(noise(1), depths)
    np.testing.assert_array_equal(found, np.zeros((50, 3)))


@pytest.mark.parametrize('turn', [np.eye(3), se3.exp_rotation((0.1, 0.2, 0.3))])
@pytest.mark.parametrize('is_slanted', [False, True])
def test_warps_are_the_derivatives_of_where_a_plane_is_seen(turn, is_slanted):
    """By differences; of one that faces the camera, and of one that does not."""
    motion = MOTION.copy()
    motion[:3, :3] = turn
    points, slopes = points_at(PIXELS), is_slanted * SLOPES
    found = warps_of(points, np.tile(slopes, (50, 1)), CAMERA, motion)

    def seen(step):
        inverse = 1 / points[:, 2:] + step @ slopes
        return CAMERA.project(se3.transform(motion, rays(PIXELS + step) / inverse))

    for i, step in enumerate(0.01 * np.eye(2)):
        np.testing.assert_allclose(found[:, :, i], (seen(step) - seen(-step)) / 0.02, atol=1e-5)


def test_small_warps_are_none():
    """Up to where one of their numbers differs from the identity by as much as the least."""
    points, slopes = points_at(PIXELS), np.zeros((50, 2))
    all_of_them = warps_of(points, slopes, CAMERA, MOTION)
    largest = np.abs(all_of_them - np.eye(2)).max(axis=(1, 2))
    least = float(np.median(largest))
    found = warps_of(points, slopes, CAMERA, MOTION, least)
    expected = np.where((largest < least)[:, None, None], np.eye(2), all_of_them)
    np.testing.assert_array_equal(found, expected)
    assert 20 < np.count_nonzero(largest < least) < 30


def test_slopes_are_those_of_the_plane_in_the_centre():
    """A twentieth less: zero counts for as much. Nothing else does: no other surface, no hole."""
    expected = np.tile(SLOPES / 1.05, (50, 1))
    found = slopes(depth_image())
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-8)
    with_others = depth_image()
    for i, (u, v) in enumerate(PIXELS.astype(int)):
        with_others[v + (3, 4)[i % 2], u - 4:u + 5] *= (0.5, np.nan)[i % 2]
    found = slopes(with_others, PIXELS[:1])
    np.testing.assert_allclose(found, expected[:1], rtol=0.05)


@pytest.mark.parametrize('depth', [np.nan, 0.0, np.inf, 9.0])
def test_without_a_surface_there_is_no_slope(depth):
    image = np.full((240, 320), depth, np.float32)
    found = slopes(image)
    np.testing.assert_array_equal(found, np.zeros((50, 2)))


def test_no_slope_is_that_of_a_single_row():
    """Of the other direction nothing is known."""
    image = np.full((240, 320), np.nan, np.float32)
    image[120] = depth_image()[120]
    pixels = np.array([(160.0, 120.0)])
    along, across = slopes(image, pixels)[0]
    assert abs(across) < 1e-9 and 0.3 < along / SLOPES[0] < 0.8


def displacement(at, offset, by_turn, motion):
    """Return by how much a pixel of the plane is displaced beside the one at the centre."""
    def seen(pixel):
        return CAMERA.project(se3.transform(motion, points_at(np.array([pixel]))))[0]

    step = 1e-3
    moved = (seen(at + step * offset) - seen(at - step * offset)) / (2 * step)
    return moved - by_turn @ offset


@pytest.mark.parametrize('turn', [np.eye(3), se3.exp_rotation((0.1, 0.2, 0.3))])
def test_the_shift_is_the_weighted_mean_of_the_displacements(turn):
    """Pixel by pixel, in the turned image, on a slanted plane."""
    grey = noise(1)
    points = points_at(PIXELS)
    windows = Windows(points, np.ones(50), gradient_moments(grey, PIXELS, WINDOW),
                      reliefs(grey, depth_image()), np.zeros((50, 2)))
    turned = np.eye(4)
    turned[:3, :3] = turn
    warps = warps_of(points, windows.slopes, CAMERA, turned)
    shifts = windows.shifts(CAMERA, MOTION, warps)
    for centre, by_turn, shift in zip(PIXELS.astype(int), warps, shifts):
        matrix, right = np.zeros((2, 2)), np.zeros(2)
        for offset in np.ndindex(WINDOW, WINDOW):
            offset = np.array(offset) - WINDOW // 2
            gradient = np.linalg.solve(by_turn.T, gradient_at(grey, *(centre + offset)))
            matrix += np.outer(gradient, gradient)
            right += gradient * (gradient @ displacement(centre, offset, by_turn, MOTION))
        np.testing.assert_allclose(shift, np.linalg.solve(matrix, right), rtol=2e-3, atol=2e-4)


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
    windows = Windows.of(view(pattern(), depth_image()), np.empty(0, int), WINDOW,
                         SETTINGS.sensor)
    assert windows.shifts(CAMERA, MOTION, windows.warps(CAMERA, MOTION)).shape == (0, 2)
    grey = np.full((240, 320), 7, np.uint8)
    flat = Windows(points_at(PIXELS), np.ones(50), gradient_moments(grey, PIXELS, WINDOW),
                   reliefs(grey, depth_image()), np.zeros((50, 2)))
    np.testing.assert_array_equal(flat.shifts(CAMERA, MOTION, flat.warps(CAMERA, MOTION)),
                                  np.zeros((50, 2)))


def test_windows_of_an_image_that_is_smaller_than_they_are():
    grey, depth = pattern()[:10], np.full((10, 320), 1.5, np.float32)
    frame = RgbdFrame(0, np.dstack(3 * [grey]), depth, dataclasses.replace(CAMERA, height=10))
    keypoints = view(pattern(), depth_image()).keypoints
    inside = np.flatnonzero(keypoints.pixels[:, 1] < 9)
    windows = Windows.of(PreparedFrame(frame, keypoints, grey), inside, 31, SETTINGS.sensor)
    assert len(windows.points) == len(inside) > 0
    assert np.isfinite(windows.shifts(CAMERA, MOTION, windows.warps(CAMERA, MOTION))).all()


@pytest.fixture
def edged():
    """Return a frame of a patterned surface at 1 m before a dull one, with keypoints beside it."""
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
    grey[:, 160:] = 120 + grey[:, 160:] // 8
    return PreparedFrame(RgbdFrame(0, grey, depth, CAMERA), keypoints, grey)


def test_a_window_on_an_edge_is_where_the_nearer_surface_is(edged):
    """And of the other one it knows nothing."""
    windows = Windows.of(edged, np.arange(len(edged.keypoints)), WINDOW, SETTINGS.sensor)
    positions, u = edged.keypoints.positions, edged.keypoints.pixels[:, 0]
    beside = u == 161.0
    np.testing.assert_allclose(windows.points[beside, 2], 1.0, rtol=0.03)
    np.testing.assert_allclose(windows.points[beside] * 2.0 / windows.points[beside, 2:],
                               positions[beside], rtol=1e-6)
    np.testing.assert_allclose(windows.points[~beside], positions[~beside])
    # a tenth of the step of inverse depth at least, as nearly all of the gradients are on it
    sigma = SETTINGS.sensor.depth_sigma
    np.testing.assert_allclose(windows.sigmas[~beside], sigma, rtol=1e-3)
    assert (windows.sigmas[beside] > 0.1 * 0.5).all()
    assert np.median(windows.sigmas[beside]) < 0.15 * 0.5
    assert not windows.reliefs.any() and np.count_nonzero(u == 158.0) > 3


@pytest.mark.parametrize('pattern_in_front', [False, True])
def test_a_window_beside_an_edge_is_where_most_of_its_gradients_are(edged, pattern_in_front):
    """As on a carpet that a plain table hides in part; or beside a table with a pattern."""
    is_patterned = (np.arange(320) < 160) == pattern_in_front
    grey = np.where(is_patterned, noise(0), np.uint8(128))
    frame = dataclasses.replace(edged, grey=grey)
    windows = Windows.of(frame, np.arange(len(edged.keypoints)), WINDOW, SETTINGS.sensor)
    beside = edged.keypoints.pixels[:, 0] == 161.0
    from_front = 1.0 - 1.0 / windows.points[beside, 2]  # of the inverse depth; 0.5 behind
    assert (from_front < 0.01).all() if pattern_in_front else (from_front > 0.2).all()
    # it may be the other one all the same
    off = from_front - (0.0 if pattern_in_front else 0.5)
    assert (np.abs(off) < 2 * windows.sigmas[beside]).all()
    assert (windows.sigmas[beside] > 0.1 * 0.5).all()


def test_a_window_with_gradients_on_both_surfaces_may_be_either(edged):
    """Of a pattern on both, and beside a blank surface."""
    beside = np.flatnonzero(edged.keypoints.pixels[:, 0] == 161.0)
    sigmas = []
    for contrast in (0, 1):
        grey = noise(0)
        grey[:, 158:] = 128 + contrast * (noise(0)[:, 158:].astype(int) - 128)
        windows = Windows.of(dataclasses.replace(edged, grey=grey), beside, WINDOW,
                             SETTINGS.sensor)
        sigmas.append(np.median(windows.sigmas))
    assert sigmas[1] > 1.5 * sigmas[0]
    assert sigmas[1] < 0.41 * 0.5


def test_an_edge_without_depth_is_that_of_the_surface_in_front(edged):
    """Many sensors have no depth on either side of an edge."""
    image = edged.frame.depth.copy()
    image[:, 159:161] = np.nan
    grey = np.where(np.arange(320) < 160, np.uint8(60), np.uint8(180))
    grey = np.repeat(grey[None], 240, axis=0)
    frame = dataclasses.replace(
        edged, frame=dataclasses.replace(edged.frame, colour=grey, depth=image), grey=grey)
    windows = Windows.of(frame, np.arange(len(edged.keypoints)), WINDOW, SETTINGS.sensor)
    beside = edged.keypoints.pixels[:, 0] == 161.0
    np.testing.assert_allclose(windows.points[beside, 2], 1.0)


def test_tracked_back_a_window_on_an_edge_is_as_uncertain(edged):
    """From the frame to itself: points are those of the keypoints, with their sigmas."""
    tracks = Tracker(SETTINGS.refinement, SETTINGS.sensor).track_back(edged, edged, np.eye(4))
    windows = Windows.of(edged, tracks.keypoints, WINDOW, SETTINGS.sensor)
    u = edged.keypoints.pixels[tracks.keypoints, 0]
    assert len(tracks) > 0.8 * len(edged.keypoints)
    np.testing.assert_allclose(tracks.sigmas, windows.sigmas, rtol=1e-3)
    assert (tracks.sigmas[u == 161.0] > 0.05).all() and np.count_nonzero(u == 161.0) > 3
    np.testing.assert_allclose(tracks.rays, windows.points[:, :2] / windows.points[:, 2:])
    np.testing.assert_allclose(tracks.depths, windows.points[:, 2])
    np.testing.assert_allclose(tracks.points[u != 161.0], windows.points[u != 161.0], atol=1e-3)


@pytest.mark.parametrize(('motion', 'gain'), [
    (MOTION, 1.0), (se3.exp(np.array([0, 0, 0, 0, 0, 0.2])) @ MOTION, 0.5),
    (se3.exp(np.array([-0.2, 0.1, 0.5, 0, 0, 0])), 0.5)])
def test_keypoints_of_a_slanted_wall_are_tracked_more_exactly(monkeypatch, motion, gain):
    """A picture on a wall that is passed: the homography of its plane is what is seen."""
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

    warped = error()
    assert warped < 0.05
    monkeypatch.setattr(Windows, 'warps', lambda self, *_: np.tile(np.eye(2), (len(self.points),
                                                                               1, 1)))
    assert warped < gain * error()
    monkeypatch.setattr(Windows, 'shifts', lambda self, *_: np.zeros((len(self.points), 2)))
    assert warped < 0.6 * error()


def books(place, step):
    """Return a view from a place along x: of books side by side every second one stands out."""
    covers = np.random.default_rng(0).integers(30, 226, (2, 120, 200)).astype(np.float32)
    v, u = np.mgrid[:240, :320].astype(float)

    def seen(u, v):
        x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
        is_front = np.floor((place + 2.0 * x) / 0.12) % 2 == 0
        z = np.where(is_front, 2.0, 2.0 + step)
        on_cover = [(a / 0.03 + 60).astype(np.float32) for a in (place + z * x + 1.0, z * y)]
        front, behind = (cv2.remap(cover, *on_cover, cv2.INTER_LINEAR,
                                   borderMode=cv2.BORDER_WRAP) for cover in covers)
        return np.where(is_front, front, behind), z

    parts = np.arange(-2, 3) / 5
    grey = np.mean([seen(u + i, v + j)[0] for i in parts for j in parts], axis=0)
    return view(np.rint(grey).astype(np.uint8), seen(u, v)[1].astype(np.float32))


@pytest.mark.parametrize('step', [0.06, 0.1, 0.15])
@pytest.mark.parametrize('motion', [-0.05, 0.05])
def test_keypoints_of_a_relief_are_where_they_are_in_the_mean(step, motion):
    """A camera that passes books: the edge of one that stands out moves as that one does."""
    T_target_source = se3.exp(np.array([motion, 0, 0, 0, 0, 0]))
    tracks = Tracker(SETTINGS.refinement, SETTINGS.sensor).track(
        books(0.0, step), books(-motion, step), T_target_source)
    true = (tracks.points[:, 0] + motion) / tracks.points[:, 2]
    farther = np.sign(motion) * CAMERA.fx * (true - tracks.rays[:, 0])
    assert len(tracks) > 300
    assert abs(farther[np.abs(farther) < 1].mean()) < 0.015


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
