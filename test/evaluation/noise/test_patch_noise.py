# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Noise added to a surface is recovered, and nothing else is taken for noise."""

import numpy as np
import pytest

from aick_ros.evaluation.noise.patch_noise import SIDE, PatchNoise
from aick_ros.geometry.camera import Camera
from aick_ros.settings import SensorSettings

CAMERA = Camera(320, 240, 262.5, 262.5, 159.5, 119.5)
PATCHES = (320 // SIDE) * (240 // SIDE)
X = (np.arange(320) - CAMERA.cx) / CAMERA.fx
Y = ((np.arange(240) - CAMERA.cy) / CAMERA.fy)[:, None]


def plane(distance, tilt=0.0):
    """Return the depth of a plane, turned about the vertical through its middle [rad]."""
    return distance / (1.0 + np.tan(tilt) * X) + 0.0 * Y


def noisy(depth, sigma, seed=0):
    return (depth + sigma * np.random.default_rng(seed).normal(size=depth.shape)).astype(
        np.float32)


def measure(depth, sensor=SensorSettings()):
    return PatchNoise.of(np.float32(depth), CAMERA, sensor)


@pytest.mark.parametrize('distance, tilt', [(0.7, 0.0), (2.0, 0.3), (3.0, -0.6)])
@pytest.mark.parametrize('sigma', [0.001, 0.01])
def test_white_noise_on_a_plane(distance, tilt, sigma):
    found = measure(noisy(plane(distance, tilt), sigma))
    assert len(found.sigmas) > 0.9 * PATCHES
    assert np.median(found.sigmas) == pytest.approx(sigma, rel=0.02)
    # 576 pixels per patch give the standard deviation to 3 %, and noise moves no plane
    assert found.sigmas.std() < 0.05 * sigma
    centres = plane(distance, tilt)[:, SIDE // 2 - 1:-SIDE // 2:SIDE].ravel()
    assert np.abs(found.depths[:, None] / centres - 1.0).min(axis=1).max() < 0.01


def test_quantisation_noise_is_the_step_by_the_root_of_twelve():
    step = 0.003
    inverse = 1.0 / plane(2.0, 0.5)
    found = measure(1.0 / (np.rint(inverse / step) * step))
    assert np.median(found.sigmas / found.depths ** 2) == pytest.approx(step / 12 ** 0.5, rel=0.05)


def test_single_outliers_are_rejected():
    depth = noisy(plane(1.5), 0.002)
    depth.flat[::50] += 0.3
    assert np.median(measure(depth).sigmas) == pytest.approx(0.002, rel=0.05)


def test_edges_holes_and_depth_out_of_range_are_ignored():
    depth = noisy(plane(1.5), 0.002)
    depth[:, 12::SIDE] = np.nan
    assert len(measure(depth).sigmas) > 0.9 * PATCHES  # of a patch one column in 24 is missing
    holes = depth.copy()
    holes[:, :160][np.random.default_rng(1).random((240, 160)) < 0.2] = np.nan
    assert len(measure(holes).sigmas) < 0.6 * PATCHES
    step = noisy(plane(1.5), 0.002)
    step[:, (np.arange(320) // 12) % 2 == 1] += 0.2
    assert len(measure(step).sigmas) == 0
    assert len(measure(depth, SensorSettings(max_depth=1.4)).sigmas) == 0
    assert len(measure(np.full((240, 320), np.nan)).sigmas) == 0


def test_curved_surfaces_are_ignored():
    # a ball of 10 cm, half a metre away, with a noise far smaller than what planes leave of it
    b = 0.5
    d2 = X ** 2 + Y ** 2 + 1.0
    root = b ** 2 - d2 * (b ** 2 - 0.1 ** 2)
    with np.errstate(invalid='ignore'):
        ball = (b - np.sqrt(root)) / d2
    assert np.isfinite(ball).sum() > 4 * SIDE ** 2
    assert len(measure(noisy(ball, 1e-5)).sigmas) == 0


def test_steep_surfaces_are_ignored():
    assert len(measure(noisy(plane(1.5, np.radians(75.0)), 0.001)).sigmas) < 0.5 * PATCHES


def test_images_smaller_than_a_patch_have_no_patches():
    camera = Camera(16, 12, 13.0, 13.0, 7.5, 5.5)
    assert len(PatchNoise.of(np.ones((12, 16), np.float32), camera, SensorSettings()).sigmas) == 0


LONG = Camera(240, 192, 420.0, 630.0, 101.0, 113.0)


def tilted(normal):
    """Return the depth of a plane through the point two metres ahead, and the incidence cosine."""
    normal = np.asarray(normal) / np.linalg.norm(normal)
    rays = np.stack(np.broadcast_arrays((np.arange(240) - LONG.cx) / LONG.fx,
                                        ((np.arange(192) - LONG.cy) / LONG.fy)[:, None], 1.0), -1)
    return 2.0 * normal[2] / (rays @ normal), rays @ normal / np.linalg.norm(rays, axis=-1)


@pytest.mark.parametrize('normal', [(0.0, 0.0, 1.0), (0.5, 0.0, 1.0), (0.0, -0.6, 1.0),
                                    (-0.3, 0.4, 1.0)])
def test_the_depth_of_a_patch_is_that_at_its_centre(normal):
    depth, _ = tilted(normal)
    found = PatchNoise.of(noisy(depth, 1e-5), LONG, SensorSettings())
    inverse = 1.0 / depth  # linear: between the four pixels in the middle, their mean
    half = SIDE // 2
    centres = np.mean([inverse[half - down::SIDE, half - right::SIDE]
                       for down in (0, 1) for right in (0, 1)], axis=0).ravel()
    assert len(found.depths) == len(centres)
    np.testing.assert_allclose(found.depths, 1.0 / centres, rtol=1e-5)


@pytest.mark.parametrize('axis, sign', [(0, 1), (0, -1), (1, 1), (1, -1)])
def test_surfaces_are_used_up_to_sixty_degrees(axis, sign):
    """By the angle between the ray through the centre of a patch and the normal."""
    normal = np.array([0.0, 0.0, 1.0])
    normal[axis] = sign * np.tan(np.radians(60.0))
    depth, cosine = tilted(normal)
    half = SIDE // 2
    expected = np.mean([cosine[half - down::SIDE, half - right::SIDE]
                        for down in (0, 1) for right in (0, 1)], axis=0)
    found = PatchNoise.of(noisy(depth, 1e-5), LONG, SensorSettings(max_depth=50.0))
    used = np.zeros(expected.shape, bool)
    centres = depth[half::SIDE, half::SIDE]
    for each in found.depths:
        used |= np.abs(centres / each - 1) < 0.002
    clear = np.abs(expected - 0.5) > 0.01
    assert used[clear].any() and not used[clear].all()
    assert np.mean((used == (expected > 0.5))[clear]) > 0.9


SINGLE = Camera(SIDE, SIDE, 60.0, 60.0, (SIDE - 1) / 2, (SIDE - 1) / 2)


def single(change, sensor=SensorSettings()):
    """Return the patches of an image of one, 2 m away with noise of 5 mm at most."""
    rng = np.random.default_rng(2)
    depth = 2.0 + rng.uniform(-0.005, 0.005, (SIDE, SIDE))
    chosen = rng.permutation(SIDE * SIDE)
    change(depth.reshape(-1), chosen)
    return PatchNoise.of(np.float32(depth), SINGLE, sensor)


@pytest.mark.parametrize('value', [np.nan, 0.0, -1.0, np.inf, 0.3, 5.0])
@pytest.mark.parametrize('count, is_used', [(57, True), (58, False)])
def test_a_tenth_of_a_patch_may_be_missing_or_lie_elsewhere(value, count, is_used):
    """576 pixels: of these 518.4 are nine tenths."""
    def change(depth, chosen):
        depth[chosen[:count]] = value
    found = single(change, SensorSettings(min_depth=0.5, max_depth=6.0))
    assert len(found.depths) == is_used
    if is_used:  # uniform noise, by the definition for normal one
        assert found.sigmas[0] == pytest.approx(0.01 / 12 ** 0.5 / 0.9866, rel=0.08)
        assert found.depths[0] == pytest.approx(2.0, abs=0.001)


@pytest.mark.parametrize('limits, is_used', [
    ({'min_depth': 1.99}, True), ({'min_depth': 2.01}, False),
    ({'max_depth': 2.01}, True), ({'max_depth': 1.99}, False)])
def test_depth_is_used_in_its_range_alone(limits, is_used):
    assert len(single(lambda depth, chosen: None, SensorSettings(**limits)).depths) == is_used


@pytest.mark.parametrize('bend, is_used', [(0.0, True), (0.5, True), (2.0, False)])
def test_a_bend_counts_by_the_noise(bend, is_used):
    """A trough across the patch, as deep as so many standard deviations of the noise."""
    def change(depth, chosen):
        across = np.abs(np.arange(SIDE * SIDE) % SIDE - (SIDE - 1) / 2) / (SIDE / 2)
        depth += bend * 0.01 / 12 ** 0.5 * 2 * across
    assert len(single(change).depths) == is_used
