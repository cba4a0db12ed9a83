# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth at keypoints: exact on planes, never between two surfaces, noise as sampled."""

import dataclasses

import cv2
import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from aick_ros.frames import depth
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

SENSOR = SensorSettings()
CAMERA = Camera(640, 480, 525, 400, 319.5, 239.5)


def plane_depth(u, v, normal=(0.3, -0.2, 1.0), distance=2.0):
    """Depth of the plane normal . X = distance at pixels, in closed form."""
    rays = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, np.ones_like(u)])
    return distance / np.tensordot(normal, rays, 1)


def test_exact_on_a_slanted_plane():
    v, u = np.mgrid[:480, :640].astype(float)
    image = plane_depth(u, v).astype(np.float32)
    rng = np.random.default_rng(0)
    pixels = rng.uniform((0, 0), (639, 479), (500, 2))
    np.testing.assert_allclose(depth.sample(image, pixels, SENSOR),
                               plane_depth(*pixels.T), rtol=1e-6)


def test_at_an_edge_the_depth_is_that_of_one_of_the_surfaces():
    image = np.full((480, 640), 3.0, np.float32)
    image[:, 300:] = 1.0
    u = np.linspace(298, 302, 41)
    expected = np.where(np.rint(u) >= 300, 1.0, 3.0)
    across = np.full_like(u, 100.3)
    np.testing.assert_allclose(
        depth.sample(image, np.column_stack([u, across]), SENSOR), expected)
    np.testing.assert_allclose(
        depth.sample(image.T.copy(), np.column_stack([across, u]), SENSOR), expected)


def test_whether_there_is_an_edge_does_not_depend_on_the_distance():
    """An edge is a ratio of depths: with all depths scaled, the samples are."""
    rng = np.random.default_rng(3)
    image = rng.uniform(1.0, 1.2, (48, 64)).astype(np.float32)
    pixels = rng.uniform((0, 0), (63, 47), (400, 2))
    found = depth.sample(image, pixels, SENSOR)
    for scale in (0.25, 4.0, 8.0):  # powers of two, so that nothing is rounded
        np.testing.assert_allclose(
            depth.sample(image * np.float32(scale), pixels, SENSOR), scale * found, rtol=1e-12)


@pytest.mark.parametrize('turns', range(4))
def test_beside_an_edge_the_nearer_surface_is_found(turns):
    """A slanted plane in front of another one: only pixels of the far one have it beside them."""
    v, u = np.mgrid[:480, :480].astype(float)
    far, near = plane_depth(u, v, distance=3.0), plane_depth(u, v, (0.2, 0.3, 1.0), 1.5)
    is_near = np.rot90(u < 200, turns)
    image = np.where(is_near, near, far).astype(np.float32)
    pixels = np.stack([u, v], axis=-1)[8:-8, 8:-8].reshape(-1, 2)
    columns, rows = pixels.astype(int).T
    found = depth.nearer_beside(image, pixels, image[rows, columns].astype(float), 4)
    reached = cv2.dilate(is_near.astype(np.uint8), np.ones((9, 9), np.uint8)) > 0
    behind = (reached & ~is_near)[rows, columns]
    np.testing.assert_array_equal(np.isfinite(found), behind)
    np.testing.assert_allclose(found[behind], near[rows, columns][behind], rtol=0.02)


def test_edges_are_those_beside_the_nearest_pixel():
    """Wherever within a pixel a keypoint lies; the depth is noise, so that each pixel differs."""
    rng = np.random.default_rng(4)
    image = rng.uniform(1.0, 1.3, (60, 80)).astype(np.float32)
    v, u = (index.ravel() for index in np.indices(image.shape))
    at_pixels = depth.nearer_beside(image, np.column_stack([u, v]), image.ravel(), 4)
    within = np.column_stack([u, v]) + rng.uniform(-0.49, 0.49, (len(u), 2))
    found = depth.nearer_beside(image, within, image.ravel(), 4)
    assert 0.1 < np.isfinite(at_pixels).mean() < 0.95
    np.testing.assert_array_equal(found, at_pixels)


def test_creases_steps_behind_and_holes_are_no_nearer_surface():
    v, u = np.mgrid[:480, :640].astype(float)
    crease = np.minimum(plane_depth(u, v, (1.0, 0.0, 1.0)), plane_depth(u, v, (-1.0, 0.0, 1.0)))
    box = np.maximum(plane_depth(u, v, (1.0, 0.0, 1.0)), plane_depth(u, v, (-1.0, 0.0, 1.0)))
    holes = np.where((u.astype(int) // 3 + v.astype(int) // 5) % 2, np.nan, 2.0)
    grazing = 2.0 / (1 + 0.04 * np.maximum(v - 239, 0))  # a floor below a wall
    ridge = 2.0 * (1 + 0.04 * np.abs(u - 320))  # a corner of a house
    for image in (crease, box, holes, grazing, ridge):
        known = np.isfinite(image)
        pixels = np.column_stack([u[known], v[known]])
        assert np.isnan(
            depth.nearer_beside(image.astype(np.float32), pixels, image[known], 4)).all()
    empty = depth.nearer_beside(np.float32(crease), np.empty((0, 2)), np.empty(0), 4)
    assert empty.shape == (0,)


def test_beside_a_hole_the_nearest_pixel_is_taken():
    image = np.full((480, 640), 2.0, np.float32)
    image[100, 100] = np.nan
    pixels = [(100.0, 100.0), (100.4, 100.4), (100.6, 100.6), (99.4, 99.4), (102.0, 100.0)]
    np.testing.assert_array_equal(depth.sample(image, pixels, SENSOR),
                                  [np.nan, np.nan, 2.0, 2.0, 2.0])


def test_depth_out_of_range_is_invalid():
    image = np.array([[0.05, 0.05, 11.0, 11.0], [0.05, 0.05, 11.0, 11.0]], np.float32)
    assert np.isnan(depth.sample(image, [(0.5, 0.5), (2.5, 0.5)], SENSOR)).all()
    wide = dataclasses.replace(SENSOR, min_depth=0.01, max_depth=20.0)
    np.testing.assert_allclose(depth.sample(image, [(0.5, 0.5), (2.5, 0.5)], wide), [0.05, 11.0],
                               rtol=1e-6)


@pytest.mark.parametrize('pixel', [(0, 0), (639, 479), (-0.4, 479.4), (639.4, -0.4)])
def test_border_pixels_have_depth(pixel):
    image = np.full((480, 640), 2.0, np.float32)
    assert depth.sample(image, [pixel], SENSOR) == pytest.approx([2.0])


def test_empty_images_and_no_pixels():
    image = np.full((480, 640), np.nan, np.float32)
    assert np.isnan(depth.sample(image, [(10.5, 20.5)], SENSOR)).all()
    assert depth.sample(image, np.empty((0, 2)), SENSOR).shape == (0,)


def test_covariances_are_those_of_sampled_pixels_and_depths():
    """Monte Carlo, with axes of different focal length; scale and direction are compared."""
    rng = np.random.default_rng(1)
    pixels, z, sigma = np.array([[500.0, 100.0]]), 3.0, 1.5
    sample = CAMERA.back_project(pixels + rng.normal(0, sigma, (100_000, 2)),
                                 z + rng.normal(0, SENSOR.depth_sigma * z ** 2, 100_000))
    covariance = depth.position_covariances(
        CAMERA.back_project(pixels, [z]), np.array([sigma]), CAMERA, SENSOR)[0]
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), sample.T)
    assert np.abs(np.linalg.eigvalsh(np.cov(whitened)) - 1).max() < 0.03


@pytest.mark.parametrize('exponent', [0.0, 1.0, 2.0])
def test_inverse_depth_sigma_is_that_of_sampled_depths(exponent):
    """Monte Carlo: standard deviation of the inverse of depths sampled from the noise model."""
    sensor = dataclasses.replace(SENSOR, depth_exponent=exponent)
    rng = np.random.default_rng(2)
    for z in (0.5, 1.0, 4.0):
        inverse = 1 / (z + rng.normal(0, sensor.depth_sigma * z ** exponent, 100_000))
        assert depth.inverse_depth_sigma(z, sensor) == pytest.approx(np.std(inverse), rel=0.02)
        by_exponent = sensor.depth_sigma * z ** sensor.inverse_depth_exponent
        assert by_exponent == pytest.approx(np.std(inverse), rel=0.02)
        sigma, power = depth.noise(sensor, 3.0)
        assert sigma * z ** power == pytest.approx(3.0 * np.std(inverse), rel=0.02)


def test_between_four_pixels_the_inverse_depth_is_bilinear_up_to_the_borders():
    rng = np.random.default_rng(5)
    image = rng.uniform(1.0, 1.0 + 0.9 * SENSOR.depth_jump, (6, 8)).astype(np.float32)
    v, u = np.array([(v, u) for v in np.arange(0, 5.01, 0.25) for u in np.arange(0, 7.01, 0.25)]).T
    inverse = RegularGridInterpolator((np.arange(6), np.arange(8)), 1.0 / image.astype(float))
    np.testing.assert_allclose(depth.sample(image, np.column_stack([u, v]), SENSOR),
                               1.0 / inverse(np.column_stack([v, u])), rtol=1e-6)


@pytest.mark.parametrize('depths, is_smooth', [
    ((1.0, 1.0199), True), ((1.0, 1.0201), False), ((2.0, 2.0398), True), ((2.0, 2.0402), False)])
def test_an_edge_is_a_jump_of_two_percent_of_the_nearer_depth(depths, is_smooth):
    assert SENSOR.depth_jump == 0.02
    image = np.tile(np.float32(depths), (4, 2))[:, 1:3][:, ::-1].copy()
    found, = depth.sample(image, [(0.25, 1.0)], SENSOR)
    nearest, beside = float(image[1, 0]), float(image[1, 1])
    expected = 1 / (0.75 / nearest + 0.25 / beside) if is_smooth else nearest
    assert found == pytest.approx(expected, rel=1e-6)


def test_the_ends_of_the_range_are_within():
    sensor = dataclasses.replace(SENSOR, min_depth=0.5, max_depth=4.0)
    nearer, farther = np.nextafter(np.float32([0.5, 4.0]), np.float32([0.0, 9.0]))
    for value, is_valid in ((0.5, True), (4.0, True), (nearer, False), (farther, False)):
        found = depth.sample(np.full((3, 3), value, np.float32), [(1.0, 1.0)], sensor)
        np.testing.assert_array_equal(found, [value if is_valid else np.nan])


@pytest.mark.parametrize('rise, is_edge', [(0.098, False), (0.102, True)])
@pytest.mark.parametrize('reach', [1, 4])
def test_an_edge_rises_by_a_tenth_of_the_inverse_depth(rise, is_edge, reach):
    """A step between two walls: in front of the far one, and behind the near one."""
    image = np.full((9, 20), 2.0, np.float32)
    image[:, 10:] = 2.0 / (1.0 + rise)
    far, = np.isfinite(
        depth.nearer_beside(image, np.array([(9.0, 4.0)]), np.array([2.0]), reach))
    assert far == is_edge
    near, = depth.nearer_beside(image, np.array([(10.0, 4.0)]), np.array([2.0 / (1.0 + rise)]),
                                reach)
    assert np.isnan(near)


@pytest.mark.parametrize('share, is_edge', [(0.48, False), (0.52, True)])
def test_at_an_edge_half_of_the_rise_is_between_two_pixels(share, is_edge):
    """The inverse depth rises by a third in three steps, of which the second is the largest."""
    image = np.full((9, 30), 0.5)
    for n, part in enumerate(((1 - share) / 2, (1 + share) / 2, 1.0)):
        image[:, 12 + n:] = 0.5 * (1 + part / 3)
    found, = depth.nearer_beside(np.float32(1 / image), np.array([(11.0, 4.0)]), np.array([2.0]),
                                 3)
    assert np.isfinite(found) == is_edge


def test_edges_further_away_than_the_reach_are_not_beside():
    image = np.full((21, 40), 2.0, np.float32)
    image[:, 20:] = 1.0
    columns = np.arange(10, 20)
    pixels = np.column_stack([columns, np.full(10, 10)]).astype(float)
    for reach in (1, 2, 5):
        found = np.isfinite(depth.nearer_beside(image, pixels, np.full(10, 2.0), reach))
        np.testing.assert_array_equal(found, columns + reach >= 20)


def test_covariances_correlate_along_the_ray():
    """In closed form, of depth noise alone: the outer product of the ray with itself."""
    position = np.array([[0.5, -0.3, 2.0]])
    sensor = dataclasses.replace(SENSOR, depth_sigma=0.01, depth_exponent=1.0)
    found, = depth.position_covariances(position, np.zeros(1), CAMERA, sensor)
    ray = position[0] / 2.0
    np.testing.assert_allclose(found, (0.01 * 2.0) ** 2 * np.outer(ray, ray), rtol=1e-12)


def test_a_steep_plane_has_no_edge_between_pixels():
    """Its inverse depth rises by a sixth per pixel on one side and falls by it on the other."""
    for axis in (0, 1):
        index = np.indices((7, 7))[axis]
        image = (1 / (0.6 + 0.1 * (index - 3))).astype(np.float32)
        assert np.isnan(
            depth.nearer_beside(image, np.array([(3.0, 3.0)]), image[3, 3:4], 1)).all()


def test_the_nearer_surface_is_that_at_the_reach():
    """Not one behind it, which is nearer still."""
    image = np.full((21, 40), 3.0, np.float32)
    image[:, 20] = 1.5
    image[:, 21:] = 1.0
    found = depth.nearer_beside(image, np.array([(17.0, 10.0)]), np.array([3.0]), 3)
    assert found == pytest.approx([1.5])


@pytest.mark.parametrize('far, is_smooth', [
    (1.5, True), (np.nextafter(np.float32(1.5), np.float32(2)), False)])
def test_a_step_of_the_jump_itself_is_no_edge(far, is_smooth):
    """Between 1 m and 1.5 m the inverse depth is interpolated, and beyond it the nearest taken."""
    image = np.array([[1.0, far], [1.0, far]], np.float32)
    found, = depth.sample(image, np.array([[0.5, 0.25]]), SensorSettings(depth_jump=0.5))
    assert found == pytest.approx(1.2 if is_smooth else 1.0, rel=1e-6)


def test_holes_are_a_pixel_smaller_when_filled_by_the_nearest_surface_beside():
    image = np.full((5, 7), np.nan, np.float32)
    image[:, 0], image[:, 6] = 2.0, 1.0
    image[2, 3] = 3.0
    expected = np.full((5, 7), np.nan, np.float32)
    expected[:, :2], expected[:, 5:] = 2.0, 1.0
    expected[2, 2:5] = expected[1:4, 3] = 3.0
    np.testing.assert_array_equal(depth.filled(image), expected)


def test_a_hole_between_two_surfaces_is_on_the_nearer_one():
    """Also at the border of the image, and in an image of one column or row."""
    image = np.array([[2.0, np.nan, 1.0, np.nan, 3.0, np.nan, np.nan, np.nan]], np.float32)
    expected = np.array([[2.0, 1.0, 1.0, 1.0, 3.0, 3.0, np.nan, np.nan]], np.float32)
    np.testing.assert_array_equal(depth.filled(image), expected)
    np.testing.assert_array_equal(depth.filled(image.T.copy()), expected.T)
    assert np.isnan(depth.filled(np.full((1, 1), np.nan, np.float32))).all()


@pytest.mark.parametrize('depths, share, reason', [
    (2.0, 1.0, ''),
    (2.0, 0.05, ''),
    (np.nan, 1.0, 'no pixel of the depth image has depth'),
    (2000.0, 1.0, 'depth is 2e+03 m in the median, outside of sensor.min_depth'),
    (0.002, 1.0, 'depth is 0.002 m in the median, outside of sensor.min_depth')])
def test_depth_in_another_unit_is_told_from_depth_in_range(depths, share, reason):
    image = np.full((480, 640), np.nan, np.float32)
    image[:round(480 * share)] = depths
    found = depth.shortage(image, SENSOR)
    assert found.startswith(reason) and bool(found) == bool(reason)
    image[:4] = 2.0  # some outliers are no range
    assert depth.shortage(image, SENSOR).startswith(reason) or not np.isfinite(depths)
