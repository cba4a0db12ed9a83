# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pairs of points and planes by the kernel, against one pair after the other in NumPy."""

import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.geometry import se3

WIDTH, HEIGHT, COUNT = 24, 18, 400
INTRINSICS = np.array([20.0, 21.0, 11.4, 8.7])
POSE = se3.exp(np.array([0.1, -0.05, 0.06, 0.03, -0.06, 0.08]))
SIGMA, REACH, SMALLEST_COSINE = 0.002, 0.05, 0.8
IMAGE_HEIGHT, FOCAL = 0.8, 1.04  # focal: length of the depth images by that of the camera
ROBUST_WIDTH = 1.7


def surface(rng):
    """Return points of a wavy wall on the grid, normals and roughness; some cells have none."""
    v, u = np.indices((HEIGHT, WIDTH)).reshape(2, -1)
    z = 2.0 + rng.normal(0, 0.03, u.size)
    points = np.column_stack([(u - INTRINSICS[2]) / INTRINSICS[0] * z,
                              (v - INTRINSICS[3]) / INTRINSICS[1] * z, z])
    normals = rng.normal((0, 0, 1), 0.3, points.shape)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points[::7], normals[::7] = np.nan, np.nan
    return (points.astype(np.float32), normals.astype(np.float32),
            rng.uniform(0, 0.005, u.size).astype(np.float32))


def displaced(point, twists):
    """Return a point of depth moved by the twist of its row, to second order."""
    twist = twists[0] + np.clip(point[1] / (point[2] * IMAGE_HEIGHT), -1, 1) * twists[2]
    step = twist[:3] + np.cross(twist[3:], point)
    return point + step + np.cross(twist[3:], step) / 2


def pair_of(cell, source, target, usable, twists, exponent):
    """Return distance, Jacobian by both normals, and point, of the pair of a cell; or None."""
    (points, normals, roughness), (planes, plane_normals, plane_roughness) = source, target
    wider = np.array([FOCAL, FOCAL, 1.0])
    seen = displaced(points[cell].astype(float) / wider, twists[0])
    arm = POSE[:3, :3] @ seen.astype(np.float32)
    point = displaced(arm + POSE[:3, 3], twists[1]) * wider
    pixel = np.round(point[:2] / point[2] * INTRINSICS[:2] + INTRINSICS[2:])
    if not (point[2] > 0 and (pixel >= 0).all() and (pixel < (WIDTH, HEIGHT)).all()):
        return None
    place = int(pixel[1]) * WIDTH + int(pixel[0])
    normal, turned = plane_normals[place].astype(float), POSE[:3, :3] @ normals[cell]
    distance = (point - planes[place]) @ normal
    if not (usable[place] and abs(distance) < REACH and turned @ normal > SMALLEST_COSINE):
        return None
    relief = (float(plane_roughness[place]) ** 2 + float(roughness[cell]) ** 2) / 2
    sigma = np.sqrt((SIGMA * point[2] ** exponent) ** 2 + relief) * point[2] * (point @ normal)
    rows = [np.concatenate([along, np.cross(arm, along)]) / sigma for along in (normal, turned)]
    return distance / sigma, *rows, point


@pytest.mark.parametrize('count', [0, 1, 31, 32, 33, COUNT])
@pytest.mark.parametrize('exponent', [0.0, -0.7])
def test_pairs_are_those_of_one_after_the_other(count, exponent):
    rng = np.random.default_rng(count)
    source, target = surface(rng), surface(rng)
    usable, chosen = rng.random(WIDTH * HEIGHT) < 0.9, rng.permutation(WIDTH * HEIGHT)[:count]
    twists = rng.normal(0, 0.02, (2, 3, 6))
    pairs = [pair for cell in chosen
             if (pair := pair_of(cell, source, target, usable, twists, exponent))]
    found = (np.empty(count), np.empty((count, 6)), np.empty(count), *np.empty((2, count, 3)),
             np.empty(count, int))
    sums = np.zeros((2, 6, 6))
    number, is_observed = kernels.point_to_plane(
        source[0], chosen, source[1], source[2], twists[0], IMAGE_HEIGHT, POSE, 1.0, -twists[1],
        IMAGE_HEIGHT, FOCAL, target[0], target[1], usable, target[2], WIDTH, HEIGHT, INTRINSICS,
        np.array([SIGMA, exponent]), np.array([ROBUST_WIDTH, 0.5, 4.0]), REACH, SMALLEST_COSINE,
        0.1, 1e-3, *found, sums)
    rest = 0.1 * (sums[0] + 1e-3 * np.eye(6)) - sums[1]
    assert is_observed == (np.linalg.eigvalsh(rest)[0] > 0)
    assert number == len(pairs) and (count < COUNT or number > 50)
    if pairs:
        values, rows, others, points = map(np.array, zip(*pairs))
        limit = ROBUST_WIDTH ** 2 * np.clip(np.median(values ** 2) / 0.5, 1.0, 4.0)
        weights = 1 / (1 + values ** 2 / limit) ** 2  # of the cost of Geman and McClure
        for computed, expected in zip(found, (values, rows, weights, points, rows[:, :3])):
            np.testing.assert_allclose(computed[:number], expected, rtol=1e-6, atol=1e-6)
        differences = rows - others
        for computed, expected in zip(sums, (rows.T @ rows, differences.T @ differences / 2)):
            np.testing.assert_allclose(computed, expected, rtol=1e-6, atol=1e-6 * abs(rows).max())


def test_no_cells_are_no_pairs():
    source, none = surface(np.random.default_rng(0)), np.empty((0, 3), np.float32)
    assert kernels.point_to_plane(
        source[0], np.arange(1, 5), source[1], source[2], np.zeros((3, 6)), 1.0, POSE, 1.0,
        np.zeros((3, 6)), 1.0, 1.0, none, none, np.empty(0, bool), none[:, 0].copy(), 0, 0,
        INTRINSICS, np.array([SIGMA, 0.0]), np.array([ROBUST_WIDTH, 1.0, 4.0]), REACH,
        SMALLEST_COSINE, 0.1, 1e-3,
        np.empty(4), np.empty((4, 6)), np.empty(4), *np.empty((2, 4, 3)), np.empty(4, int),
        np.zeros((2, 6, 6))) == (0, True)
