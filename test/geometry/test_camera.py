# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Cameras against the equations of the distortion models."""

import dataclasses
import math
from contextlib import suppress

import numpy as np
import pytest

from aick_ros.borders.limits import (
    MAX_DISTORTION, MAX_PIXEL_LENGTH, MAX_PIXELS, MAX_SIDE, MIN_FOCAL_LENGTH)
from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera

FR1 = Camera(640, 480, 517.306408, 516.469215, 318.643040, 255.313989, 'plumb_bob',
             (0.262383, -0.953104, -0.005358, 0.002628, 1.163314))
RATIONAL = Camera(640, 480, 500, 505, 320, 240, 'rational_polynomial',
                  (0.5, -0.2, 0.001, -0.002, 0.02, 0.6, -0.1, 0.01))
PRISM = dataclasses.replace(RATIONAL, distortion=(
    *RATIONAL.distortion, 0.003, -0.002, -0.005, 0.004))
TILTED = dataclasses.replace(RATIONAL, distortion=(*PRISM.distortion, 0.03, -0.05))
FISHEYE = Camera(640, 480, 300, 302, 320, 240, 'equidistant', (0.02, -0.01, 0.003, -0.001))
PINHOLE = Camera(640, 480, 525, 525, 319.5, 239.5)
K = [500.0, 0.0, 320.0, 0.0, 505.0, 240.0, 0.0, 0.0, 1.0]


def distort(camera, x, y):
    """The distortion equations as OpenCV and sensor_msgs document them."""
    r2 = x * x + y * y
    if camera.distortion_model == 'equidistant':
        k1, k2, k3, k4 = camera.distortion
        r = np.sqrt(r2)
        theta = np.arctan(r)
        scale = theta * (1 + k1 * theta**2 + k2 * theta**4 + k3 * theta**6 + k4 * theta**8) / r
        return x * scale, y * scale
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, *tilt = (camera.distortion + (0.0,) * 14)[:14]
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return tilted(
        x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + s1 * r2 + s2 * r2**2,
        y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + s3 * r2 + s4 * r2**2, *tilt)


def tilted(x, y, about_x, about_y):
    """Return where a sensor that is tilted, about x and then about y, sees rays (x, y, 1)."""
    R = se3.exp_rotation([0, -about_y, 0]) @ se3.exp_rotation([-about_x, 0, 0])
    seen = np.array([[R[2, 2], 0, -R[0, 2]], [0, R[2, 2], -R[1, 2]], [0, 0, 1]]) @ R @ np.stack(
        [x, y, np.ones_like(x)])
    return seen[0] / seen[2], seen[1] / seen[2]


@pytest.mark.parametrize('camera', [FR1, RATIONAL, PRISM, TILTED, FISHEYE, PINHOLE],
                         ids=lambda camera: f'{camera.distortion_model}{len(camera.distortion)}')
def test_projection_and_back_projection_follow_the_equations(camera):
    u, v = np.meshgrid(np.linspace(0, 639, 17), np.linspace(0, 479, 13))
    pixels = np.column_stack([u.ravel(), v.ravel()])
    depths = np.linspace(0.5, 5, len(pixels))
    points = camera.back_project(pixels, depths)
    np.testing.assert_array_equal(points[:, 2], depths)
    x, y = points[:, 0] / depths, points[:, 1] / depths
    if camera.distortion:
        x, y = distort(camera, x, y)
    expected = np.column_stack([camera.fx * x + camera.cx, camera.fy * y + camera.cy])
    np.testing.assert_allclose(expected, pixels, atol=1e-3)
    np.testing.assert_allclose(camera.project(points), expected, atol=1e-6)


def test_empty_input_gives_empty_output():
    assert FR1.normalize(np.empty((0, 2))).shape == (0, 2)
    assert FR1.project(np.empty((0, 3))).shape == (0, 2)
    assert FISHEYE.back_project(np.empty((0, 2)), np.empty(0)).shape == (0, 3)


def test_the_matrix_of_camera_info_may_have_its_shape():
    flat = Camera.from_camera_info(640, 480, K)
    assert Camera.from_camera_info(640, 480, np.reshape(K, (3, 3))) == flat
    assert Camera.from_camera_info(640, 480, np.reshape(K, (3, 3)).tolist()) == flat
    with pytest.raises(InputError, match='camera_info is not of numbers'):
        Camera.from_camera_info(640, 480, np.reshape(K, (9, 1, 1)).tolist())


def test_from_camera_info():
    camera = Camera.from_camera_info(640, 480, K, [0.0] * 5, 'plumb_bob')
    assert camera == Camera(640, 480, 500, 505, 320, 240)
    assert camera.distortion == ()
    np.testing.assert_array_equal(camera.matrix.ravel(), K)
    assert Camera.from_camera_info(640, 480, K, FR1.distortion, '').distortion == FR1.distortion


@pytest.mark.parametrize('at, value', [(1, 0.9), (1, -0.9), (8, 0.0)])
def test_a_small_skew_and_a_scale_that_is_left_out_change_nothing(at, value):
    k = [*K[:at], value, *K[at + 1:]]
    assert Camera.from_camera_info(640, 480, k) == Camera.from_camera_info(640, 480, K)


@pytest.mark.parametrize('at, value', [
    (1, 1.1), (1, -1.1), (1, math.nan), (3, 0.1), (6, 320.0), (7, math.nan), (8, 2.0),
    (8, math.nan)])
def test_what_is_no_intrinsic_matrix_is_rejected(at, value):
    with pytest.raises(InputError, match=r'it must be fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row'):
        Camera.from_camera_info(640, 480, [*K[:at], value, *K[at + 1:]])


def test_a_matrix_by_columns_is_rejected_with_its_numbers():
    by_columns = np.reshape(K, (3, 3)).T.ravel()
    with pytest.raises(InputError, match=r'^k of camera_info is \[500, 0, 0, 0, 505, 0, 320, 240, '
                       r'1\]: it must be fx, 0, cx, 0, fy, cy, 0, 0, 1, row by row; check the '
                       r'driver$'):
        Camera.from_camera_info(640, 480, by_columns)


@pytest.mark.parametrize('d', [[0.0] * 4, []])
def test_a_fisheye_with_zero_coefficients_stays_equidistant(d):
    camera = Camera.from_camera_info(640, 480, K, d, 'equidistant')
    (x, y), = camera.normalize([(camera.cx + camera.fx * 0.5, camera.cy)])
    assert (x, y) == pytest.approx((np.tan(0.5), 0.0))


@pytest.mark.parametrize('camera', [
    Camera(640, 480, 150, 150, 320, 240, 'equidistant', (0.02, -0.01, 0.003, -0.001)),
    Camera(640, 480, 350, 350, 320, 240, 'plumb_bob', (-0.35, 0.0, 0.0, 0.0))],
    ids=['beyond a right angle', 'beyond the turning point of the polynomial'])
def test_pixels_without_a_ray_in_front_of_the_camera_are_nan(camera):
    """Also on the row and the column of the centre, where one coordinate alone is right."""
    with_ray = camera.normalize([(330, 245), (320, 250), (310, 240)])
    assert np.isfinite(with_ray).all()
    outside = 320 + 2.5 * camera.fx
    without = camera.normalize([(0, 0), (outside, 240), (640 - outside, 240), (320, outside),
                                (320, 480 - outside)])
    assert np.isnan(without).all()


@pytest.mark.parametrize('fields, sentence', [
    ((640, 480, [0.0] * 9), r'k\[0\] is 0; calibrate'),
    ((640, 480, K[:8]), '8 numbers: 9 are required'),
    ((0, 0, K), '0 x 0 pixels'),
    ((640, 480, [-500.0, *K[1:]]), 'focal lengths must be positive'),
    ((640, 480, [float('nan'), *K[1:]]), 'all must be finite, and focal lengths'),
    ((640, 480, [*K[:2], math.inf, *K[3:]]), 'cx inf, .* all must be finite, and focal lengths'),
    ((640, 480, K, [0.1, 0.2, 0.3], 'plumb_bob'), '3 coefficients: it must have 0 or 4 or 5'),
    ((640, 480, K, [0.1, 0.2, 0.3, float('inf')], 'plumb_bob'), 'not all finite'),
    ((640, 480, [1e300, *K[1:]]), 'from 0.1 to 1e'),
    ((640, 480, [1e-300, *K[1:]]), 'from 0.1 to 1e'),
    ((640, 480, [*K[:2], 1e300, *K[3:]]), 'cx and cy at most'),
    ((640, 480, K, [1e300, 0.0, 0.0, 0.0]), 'not all finite and at most'),
    ((40000, 480, K), 'at most 32767 on a side'),
    ((8192, 4096, K), 'and 16777216 in all'),
    ((640, 480, 'abcdefghi'), 'camera_info is not of numbers'),
    ((640, 480, None), 'camera_info is not of numbers'),
    ((640, 480, K, 5), 'camera_info is not of numbers'),
    ((None, 480, K), 'camera_info is not of numbers'),
    ((math.inf, 480, K), 'camera_info is not of numbers'),
    ((640, 480, [10 ** 400, *K[1:]]), 'camera_info is not of numbers'),
    ((640, 480, K, [0.1] * 4, 'thin_prism'), "unknown distortion model 'thin_prism'"),
])
def test_invalid_calibrations_are_rejected(fields, sentence):
    with pytest.raises(InputError, match=sentence):
        Camera.from_camera_info(*fields)


@pytest.mark.parametrize('focal_length', ['fx', 'fy'])
def test_a_focal_length_below_a_pixel_is_positive_and_zero_is_not(focal_length):
    assert dataclasses.replace(PINHOLE, **{focal_length: 0.5})
    with pytest.raises(InputError, match='must be positive'):
        dataclasses.replace(PINHOLE, **{focal_length: 0.0})


@pytest.mark.parametrize('model, counts', [
    ('plumb_bob', {0, 4, 5}), ('rational_polynomial', {0, 8, 12, 14}), ('equidistant', {4})])
def test_the_numbers_of_coefficients_are_those_of_opencv(model, counts):
    accepted = set()
    for count in range(16):
        with suppress(InputError):
            dataclasses.replace(PINHOLE, distortion_model=model, distortion=(0.01,) * count)
            accepted.add(count)
    assert accepted == counts


@pytest.mark.parametrize('changes', [
    {'width': '640'}, {'width': 640.5}, {'height': None}, {'fx': '500'}, {'fy': None}, {'cx': 1j},
    {'cy': 10 ** 400}, {'distortion': None}, {'distortion': 'abcd'}, {'distortion': [None] * 4}])
def test_what_is_no_number_is_rejected(changes):
    with pytest.raises(InputError, match='the camera is not of numbers'):
        dataclasses.replace(PINHOLE, **changes)


def test_coefficients_in_an_array_are_those_in_a_tuple():
    camera = dataclasses.replace(FR1, distortion=np.array(FR1.distortion))
    assert camera == FR1 and hash(camera) == hash(FR1)


def following(number):
    return np.nextafter(number, np.inf)


@pytest.mark.parametrize('largest, beyond', [
    ({'width': MAX_SIDE, 'height': 1}, {'width': MAX_SIDE + 1, 'height': 1}),
    ({'width': 1, 'height': MAX_SIDE}, {'width': 1, 'height': MAX_SIDE + 1}),
    ({'width': 8192, 'height': MAX_PIXELS // 8192}, {'width': 8193, 'height': MAX_PIXELS // 8192}),
    ({'width': 1}, {'width': 0}), ({'height': 1}, {'height': 0}),
    ({}, {'height': -480}),
    *(({name: MAX_PIXEL_LENGTH}, {name: following(MAX_PIXEL_LENGTH)})
      for name in ('fx', 'fy', 'cx', 'cy')),
    *(({name: -MAX_PIXEL_LENGTH}, {name: -following(MAX_PIXEL_LENGTH)}) for name in ('cx', 'cy')),
    *(({name: MIN_FOCAL_LENGTH}, {name: np.nextafter(MIN_FOCAL_LENGTH, 0.0)})
      for name in ('fx', 'fy')),
    *(({'distortion': (0.0, sign * MAX_DISTORTION, 0.0, 0.0)},
       {'distortion': (0.0, sign * following(MAX_DISTORTION), 0.0, 0.0)}) for sign in (1, -1)),
    ({}, {'cy': 2 ** 64}), ({}, {'fx': 10 ** 300}),
    ({}, {'cx': math.inf}), ({}, {'cy': math.nan}), ({}, {'fy': math.inf}),
    ({}, {'distortion': (0.0, 0.0, math.nan, 0.0)})])
def test_limits_are_within(largest, beyond):
    assert dataclasses.replace(PINHOLE, **largest)
    with pytest.raises(InputError, match='the camera|the distortion coefficients'):
        dataclasses.replace(PINHOLE, **beyond)


@pytest.mark.parametrize('changes, sentence', [
    ({'fy': -2.0}, 'the camera has fx 525, fy -2, cx 319.5, cy 239.5: all must be finite, and '
     'focal lengths must be positive; calibrate the camera'),
    ({'cy': 2e6}, 'the camera has fx 525, fy 525, cx 319.5, cy 2e+06: focal lengths must be from '
     '0.1 to 1e+06 pixels, cx and cy at most 1e+06; calibrate the camera'),
    ({'height': 0}, 'the camera image has 640 x 0 pixels: width and height must be positive'),
    ({'width': 640, 'height': 40_000}, 'the camera image has 640 x 40000 pixels: at most 32767 on '
     'a side and 16777216 in all are supported'),
    ({'width': 8193, 'height': 8192}, 'the camera image has 8193 x 8192 pixels: at most 32767 on '
     'a side and 16777216 in all are supported'),
    ({'distortion': (0.5, 0.0, 0.0, 2e6)}, 'the distortion coefficients (0.5, 0.0, 0.0, 2000000.0)'
     ' are not all finite and at most 1e+06: calibrate the camera'),
    ({'distortion_model': 'm' * 302}, f"unknown distortion model '{'m' * 149} [... 4 characters "
     f"...] {'m' * 149}': supported are plumb_bob, rational_polynomial, equidistant"),
    ({'distortion_model': 'magic'}, "unknown distortion model 'magic': supported are plumb_bob, "
     'rational_polynomial, equidistant'),
    ({'distortion': (1.0,)}, 'distortion model plumb_bob has 1 coefficients: it must have 0 or 4 '
     'or 5')])
def test_a_sentence_has_the_numbers_of_the_camera(changes, sentence):
    with pytest.raises(InputError) as raised:
        dataclasses.replace(PINHOLE, **changes)
    assert str(raised.value) == sentence


@pytest.mark.parametrize('camera', [
    Camera(640, 480, 400, 410, 320, 240, 'plumb_bob', (-0.28, 0.07, 0.001, -0.0005, 0.0)),
    RATIONAL, FISHEYE], ids=lambda camera: camera.distortion_model)
def test_undistortion_has_converged_at_the_corners(camera):
    """The equations bring each ray back to its pixel, far beyond what a keypoint can have."""
    corners = np.array([(0, 0), (639, 0), (0, 479), (639, 479), (0, 240), (320, 0)], float)
    x, y = distort(camera, *camera.normalize(corners).T)
    np.testing.assert_allclose(
        np.column_stack([camera.fx * x + camera.cx, camera.fy * y + camera.cy]), corners,
        atol=1e-5)


@pytest.mark.parametrize('fields, sentence', [
    ((640, 480, K[:8]), 'k of camera_info has 8 numbers: 9 are required, row by row'),
    ((640, 480, [0.0] * 9), 'camera_info is not calibrated: k[0] is 0; calibrate the camera or '
     'start its driver with a calibration file')])
def test_a_camera_info_that_is_none_says_what_is_required(fields, sentence):
    with pytest.raises(InputError) as raised:
        Camera.from_camera_info(*fields)
    assert str(raised.value) == sentence


def test_what_returns_far_from_its_pixel_has_no_ray():
    """By more than a tenth of a pixel: of a model whose undistortion ends elsewhere."""
    camera = Camera(640, 480, 525, 525, 320, 240, 'equidistant', (0.1, 0.0, 0.0, 0.0))
    for error, has_ray in ((0.09, True), (0.11, False), (-0.09, True), (-0.11, False)):
        class Inexact(Camera):
            def project(self, points, error=error):
                return super().project(points) + (0.0, error)
        found = Inexact(**dataclasses.asdict(camera)).normalize([(100.0, 100.0)])
        assert np.isfinite(found).all() == has_ray


def test_beyond_the_fold_of_a_polynomial_there_is_no_ray():
    """With r (1 - 0.3 r^2) no ray is seen farther from the centre than at r^2 = 1 / 0.9."""
    camera = Camera(640, 480, 200, 200, 320, 240, 'plumb_bob', (-0.3, 0.0, 0.0, 0.0))
    farthest = 200 * np.sqrt(1 / 0.9) * (1 - 1 / 3)
    inside, beyond = camera.normalize(np.array([(320 + 0.9 * farthest, 240.0),
                                                (320 + farthest + 1.0, 240.0)]))
    assert np.isnan(beyond).all()
    assert inside[0] * (1 - 0.3 * inside[0] ** 2) == pytest.approx(0.9 * farthest / 200, abs=1e-11)


def test_what_is_no_number_is_said_with_the_reason_of_python():
    with pytest.raises(InputError, match=(
            r'^the camera is not of numbers \(.+\): width and height must be whole numbers, focal '
            r'lengths, centre and coefficients numbers$')):
        dataclasses.replace(PINHOLE, height=4.5)
    with pytest.raises(InputError, match=(
            r'^camera_info is not of numbers \(.+\): required are width and height, and the lists '
            r'k and d$')):
        Camera.from_camera_info(640, None, K)


@pytest.mark.parametrize('size', [np.uint8(255), np.int64(255), np.array(255)])
def test_sizes_of_any_whole_number_are_those_of_int(size):
    assert dataclasses.replace(PINHOLE, width=size) == dataclasses.replace(PINHOLE, width=255)
    assert dataclasses.replace(PINHOLE, height=size) == dataclasses.replace(PINHOLE, height=255)
    hash(dataclasses.replace(PINHOLE, width=size, height=size))


@pytest.mark.parametrize('width, height, f, model, d', [
    (640, 480, 517.3, 'plumb_bob', (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),  # Kinect, TUM fr1
    (512, 424, 365.0, 'plumb_bob', (0.0929, -0.2701, 0.0, 0.0, 0.0901)),  # Kinect One
    (1280, 720, 900.0, 'plumb_bob', (0.16, -0.5, 0.0, 0.0, 0.46)),  # RealSense L515
    (640, 480, 615.0, 'plumb_bob', (0.0,) * 5),  # RealSense D435
    (1280, 720, 608.6, 'rational_polynomial',  # Azure Kinect, colour, and wide depth
     (0.4626, -2.4699, 0.00099, 0.00018, 1.3996, 0.3402, -2.2881, 1.3272)),
    (1024, 1024, 504.7, 'rational_polynomial', (5.2, 3.4, -5e-5, 8e-5, 0.179, 5.53, 5.06, 0.923)),
    (1280, 720, 1012.0, 'rational_polynomial',  # OAK-D, and its wide lens
     (-10.9, 65.8, 0.0012, -0.0004, -89.7, -11.06, 66.5, -91.8, *(0.0,) * 6)),
    (1280, 800, 565.0, 'rational_polynomial',
     (9.7, 2.3, 1e-4, 1e-4, 0.05, 10.1, 5.5, 0.44, *(0.0,) * 6)),
    (640, 480, 280.0, 'plumb_bob', (-0.3, 0.09, 0.0, 0.0, -0.012)),  # 98 degrees
    (848, 800, 286.0, 'equidistant', (-0.0065, 0.043, -0.041, 0.0077))])  # T265
def test_lenses_of_real_cameras_are_accepted(width, height, f, model, d):
    k = [f, 0.0, width / 2, 0.0, f, height / 2, 0.0, 0.0, 1.0]
    assert Camera.from_camera_info(width, height, k, d, model).fx == f


@pytest.mark.parametrize('d', [
    (1000.0,) * 5, (-10.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1000.0, 0.0, 0.0),
    (0.2624, -0.9531, 1.1633, -0.0054, 0.0026), (525.0, 525.0, 319.5, 239.5)])
def test_coefficients_that_no_lens_has_are_named(d):
    """Numbers that nobody has set, in another order, or those of k."""
    with pytest.raises(InputError, match=r'^d of camera_info is \[.*\], with which only \d+% of '
                       'the pixels have a ray: check that it is in the order of plumb_bob'):
        Camera.from_camera_info(640, 480, K, d)


def test_a_matrix_that_nobody_has_filled_in_is_not_calibrated():
    with pytest.raises(InputError, match='not calibrated: its matrix is the identity; calibrate'):
        Camera.from_camera_info(640, 480, np.eye(3).ravel())
