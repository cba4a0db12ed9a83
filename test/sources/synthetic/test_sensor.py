# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The statistics of the imperfections against the model they are to follow."""

import dataclasses
import math
import statistics

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.sources.synthetic import ColourSensor, DepthSensor
from aick_ros.sources.synthetic.motion_blur import motion_blur

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)


def wall(depth):
    return np.full((480, 640), depth, np.float32)


def with_only(**imperfections):
    return dataclasses.replace(DepthSensor.perfect(), **imperfections)


def measure(sensor, depth, seed=0):
    return sensor.measure(depth, CAMERA, np.random.default_rng(seed)).astype(np.float64)


def strip(near, far, columns):
    depth = wall(far)
    depth[:, columns] = near
    return depth


def test_a_perfect_sensor_changes_nothing():
    rng = np.random.default_rng(1)
    depth = rng.uniform(0.2, 9.0, (480, 640)).astype(np.float32)
    depth[::7] = np.nan
    np.testing.assert_allclose(measure(DepthSensor.perfect(), depth), depth, rtol=2e-7)
    colour = rng.integers(0, 256, (480, 640, 3), np.uint8)
    assert np.array_equal(ColourSensor.perfect().measure(colour, 1.0, rng), colour)


@pytest.mark.parametrize('depth', [1.0, 2.0, 4.0])
@pytest.mark.parametrize('grain', [0.0, 1.0])
def test_noise_grows_with_the_square_of_the_depth(depth, grain):
    error = measure(with_only(sigma=0.0015, grain=grain), wall(depth)) - depth
    assert error.std() == pytest.approx(0.0015 * depth ** 2, rel=0.04)
    assert abs(error.mean()) < 0.1 * error.std()


def test_neighbours_have_noise_in_common():
    error = measure(with_only(sigma=0.001, grain=1.0), wall(1.0)) - 1.0
    together = np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1]
    # white noise smoothed by a Gaussian of width g is correlated by exp(-d^2 / 4 g^2)
    assert together == pytest.approx(math.exp(-0.25), abs=0.03)
    error = measure(with_only(sigma=0.001), wall(1.0)) - 1.0
    assert abs(np.corrcoef(error[:, 1:].ravel(), error[:, :-1].ravel())[0, 1]) < 0.01


def test_depth_comes_in_steps_of_the_disparity():
    ramp = np.linspace(0.6, 4.8, 480 * 640, dtype=np.float32).reshape(480, 640)
    measured = measure(with_only(step=0.0029), ramp)
    steps = 1 / measured / 0.0029
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-3)
    assert np.all(np.abs(1 / measured - 1 / ramp.astype(float)) < 0.0029 / 2 + 1e-6)


def test_noise_and_steps_together():
    sensor = with_only(sigma=0.0013, grain=1.0, step=0.0029)
    inverse = 1 / measure(sensor, np.linspace(1.9, 2.1, 480 * 640, dtype=np.float32).reshape(
        480, 640))
    error = inverse - 1 / np.linspace(1.9, 2.1, 480 * 640).reshape(480, 640)
    assert error.std() == pytest.approx(math.sqrt(0.0013 ** 2 + 0.0029 ** 2 / 12), rel=0.04)


def test_only_the_range_is_measured():
    depth = np.tile(np.linspace(0.2, 7.0, 640, dtype=np.float32), (480, 1))
    measured = measure(with_only(min_depth=0.5, max_depth=5.0), depth)
    assert np.array_equal(np.isfinite(measured), (depth >= 0.5) & (depth <= 5.0))


def test_things_throw_a_shadow_to_their_left():
    near, far, baseline = 1.0, 2.5, 0.075
    missing = np.isnan(measure(with_only(baseline=baseline), strip(near, far, slice(300, 400))))
    # what a projector to the right cannot reach, ray by ray
    hidden = []
    for column in range(640):
        x = (column - CAMERA.cx) / CAMERA.fx
        depth = near if 300 <= column < 400 else far
        edges = [(edge - 0.5 - CAMERA.cx) / CAMERA.fx * near for edge in (300, 400)]
        # where the ray from the projector to the point crosses the plane of the strip
        crossing = baseline + (x * depth - baseline) * near / depth
        hidden.append(depth == far and edges[0] < crossing < edges[1])
    assert np.all(missing == missing[0])
    assert np.count_nonzero(missing[0] != hidden) <= 2
    assert np.flatnonzero(missing[0])[[0, -1]] == pytest.approx(
        [300 - baseline * CAMERA.fx * (1 / near - 1 / far), 299], abs=2)


@pytest.mark.parametrize('degrees', [0, 45, 70, 78, 83, 87])
def test_surfaces_seen_aslant_have_no_depth(degrees):
    limit, angle = 80, math.radians(degrees)
    # a plane through (0, 0, 2), turned about y
    x = (np.arange(640) - CAMERA.cx) / CAMERA.fx
    y = (np.arange(480)[:, None] - CAMERA.cy) / CAMERA.fy
    with np.errstate(divide='ignore'):
        depth = 2 / (1 - x * math.tan(angle)) + 0 * y
    depth = np.where((depth > 0.3) & (depth < 9), depth, np.nan).astype(np.float32)
    measured = measure(with_only(max_incidence=math.radians(limit)), depth)
    facing = abs(math.cos(angle) - x * math.sin(angle)) / np.sqrt(x * x + y * y + 1)
    incidence = np.degrees(np.arccos(facing))
    inner = np.isfinite(depth)
    inner[:, 1:-1] &= np.isfinite(depth[:, 2:]) & np.isfinite(depth[:, :-2])
    inner[:, [0, -1]] = inner[[0, -1]] = False
    assert np.all(np.isnan(measured[inner & (incidence > limit + 0.3)]))
    assert np.all(np.isfinite(measured[inner & (incidence < limit - 0.3)]))


def test_edges_are_frayed():
    sigma, beside = 0.5, 320
    measured = measure(with_only(edge_jitter=sigma), strip(1.0, 2.0, slice(beside, 640)))
    share = (measured == 1.0).mean(axis=0)
    # a pixel shows what is at a normally distributed place, rounded to a pixel
    normal = statistics.NormalDist(0, sigma)
    assert share[beside - 1] == pytest.approx(1 - normal.cdf(0.5), abs=0.06)
    assert share[beside] == pytest.approx(1 - normal.cdf(-0.5), abs=0.06)
    assert share[beside - 5] == 0 and share[beside + 4] == 1


def test_colour_noise_has_its_standard_deviation():
    grey = np.full((480, 640, 3), 128, np.uint8)
    noise = ColourSensor(sigma=2.0).measure(grey, 1.0, np.random.default_rng(3)) - 128.0
    assert noise.std() == pytest.approx(math.sqrt(4 + 1 / 12), rel=0.02)
    assert abs(noise.mean()) < 0.02
    assert abs(np.corrcoef(noise[..., 0].ravel(), noise[..., 1].ravel())[0, 1]) < 0.01


def test_colour_is_scaled_by_the_gain_and_saturates():
    sensor = dataclasses.replace(ColourSensor.perfect(), exposure_swing=0.5)
    colour = np.array([[[0, 100, 200]]], np.uint8)
    assert sensor.measure(colour, 1.4, np.random.default_rng(0)).tolist() == [[[0, 140, 255]]]


@pytest.mark.parametrize('axis', range(6))
@pytest.mark.parametrize('pixel', [(60, 70), (590, 400), (320, 240)])
def test_motion_blur_smears_a_dot_along_its_way(axis, pixel):
    depth, sigma = 1.5, 2.5
    twist = np.zeros(6)
    twist[axis] = 0.03 if axis < 3 else 0.02
    point = CAMERA.back_project(np.array([pixel]), [depth])
    # the point stands still while the camera moves
    start, end = (CAMERA.project(se3.transform(se3.inverse(se3.exp(half)), point))[0]
                  for half in (-twist / 2, twist / 2))
    columns, rows = np.meshgrid(np.arange(640), np.arange(480))
    dot = 250 * np.exp(-((columns - pixel[0]) ** 2 + (rows - pixel[1]) ** 2) / (2 * sigma ** 2))
    smeared = motion_blur(np.repeat(np.rint(dot)[..., None], 3, axis=2).astype(np.uint8),
                          wall(depth), CAMERA, se3.exp(twist))[..., 1].astype(float)
    for places, moved, centre in zip((columns, rows), end - start, pixel):
        mean = np.average(places, weights=smeared)
        spread = np.average((places - mean) ** 2, weights=smeared)
        assert mean == pytest.approx(centre, abs=0.3)
        # a dot smeared evenly over a way adds a twelfth of its square
        assert spread == pytest.approx(sigma ** 2 + moved ** 2 / 12, rel=0.08, abs=0.3)


@pytest.mark.parametrize('make', [
    lambda: DepthSensor(sigma=-0.1), lambda: ColourSensor(shutter=-1.0),
    lambda: DepthSensor(step=math.nan)])
def test_negative_imperfections_are_rejected(make):
    with pytest.raises(InputError, match='it must be 0 or more'):
        make()


def test_beyond_what_the_noise_can_tell_from_infinity_there_is_no_depth():
    """At 1 / sigma the disparity is negative for one pixel in six, by a normal distribution."""
    measured = measure(with_only(sigma=0.02), wall(50.0))
    assert np.isnan(measured).mean() == pytest.approx(statistics.NormalDist().cdf(-1), abs=0.01)
    assert np.nanmin(measured) > 0 and np.isfinite(measured[~np.isnan(measured)]).all()


def test_the_default_sensor_is_a_kinect():
    """Of a baseline of 75 mm that measures from 0.5 to 5 m; 1.3 mm of noise at a metre."""
    sensor = DepthSensor()
    assert (sensor.baseline, sensor.min_depth, sensor.max_depth) == (0.075, 0.5, 5.0)
    measured = measure(sensor, wall(1.0))
    middle = measured[100:380, 100:540]
    assert np.nanstd(middle) == pytest.approx(math.hypot(0.0013, 0.0029 / math.sqrt(12)), rel=0.2)


@pytest.mark.parametrize('make, sentence', [
    (lambda: DepthSensor(sigma=-0.1), 'depth sensor: sigma is -0.1: it must be 0 or more'),
    (lambda: ColourSensor(exposure_swing=-2.0),
     'colour sensor: exposure_swing is -2: it must be 0 or more')])
def test_the_sentence_names_the_sensor_and_the_number(make, sentence):
    with pytest.raises(InputError) as raised:
        make()
    assert str(raised.value) == sentence
