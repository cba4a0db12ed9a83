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
