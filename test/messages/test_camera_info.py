# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""The camera of a camera_info: which matrix is used, and the effect of binning and a roi."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry.camera import Camera
from aick_ros.messages.camera_info import is_rectified, to_camera

D = [0.1, -0.2, 0.001, 0.002, 0.05]


def info(**changes):
    fields = {'width': 1280, 'height': 960, 'distortion_model': 'plumb_bob', 'd': D,
              'k': [1000.0, 0.0, 640.0, 0.0, 1010.0, 480.0, 0.0, 0.0, 1.0],
              'p': [900.0, 0.0, 630.0, 0.0, 0.0, 910.0, 470.0, 0.0, 0.0, 0.0, 1.0, 0.0],
              'binning_x': 0, 'binning_y': 0, **changes}
    roi = {'x_offset': 0, 'y_offset': 0, 'width': 0, 'height': 0, **fields.pop('roi', {})}
    return SimpleNamespace(roi=SimpleNamespace(**roi), **fields)


def test_raw_images_use_k_and_d_and_rectified_ones_p():
    assert to_camera(info()) == Camera(1280, 960, 1000, 1010, 640, 480, 'plumb_bob', tuple(D))
    assert to_camera(info(), rectified=True) == Camera(1280, 960, 900, 910, 630, 470)


def test_a_camera_without_distortion_needs_no_p():
    assert to_camera(info(d=[], p=[0.0] * 12), rectified=True) == to_camera(info(d=[]))
    with pytest.raises(InputError) as raised:
        to_camera(info(p=[0.0] * 12), rectified=True)
    assert str(raised.value) == (
        'the images are rectified, and camera_info has no p for them: calibrate the camera, or '
        'use its raw images (the parameter image_rectification says which they are)')


@pytest.mark.parametrize('rectified', [False, True])
def test_a_point_projects_into_the_cropped_and_binned_image(rectified):
    """Oracle: project into the whole image, then crop and bin the pixel by hand."""
    whole = to_camera(info(), rectified)
    sent = to_camera(info(binning_x=2, binning_y=4, roi={
        'x_offset': 100, 'y_offset': 40, 'width': 800, 'height': 640}), rectified)
    assert (sent.width, sent.height) == (400, 160)
    points = np.random.default_rng(0).uniform((-0.3, -0.3, 1), (0.3, 0.3, 2), (50, 3))
    np.testing.assert_allclose(sent.project(points),
                               (whole.project(points) - (100, 40)) / (2, 4), atol=1e-9)


@pytest.mark.parametrize('size', [{'width': 800}, {'height': 640}, {}])
def test_a_roi_without_a_size_is_the_whole_image(size):
    """As the message defines: 0 means that the roi is not used."""
    roi = {'x_offset': 100, 'y_offset': 40, **size}
    assert to_camera(info(roi=roi)) == to_camera(info())


@pytest.mark.parametrize('roi', [{'x_offset': 480, 'y_offset': 320, 'width': 800, 'height': 640}])
def test_a_roi_up_to_the_border_is_within(roi):
    assert to_camera(info(roi=roi)).width == 800


@pytest.mark.parametrize('roi', [{'x_offset': 600, 'width': 800, 'height': 100},
                                 {'y_offset': 900, 'width': 100, 'height': 100}])
def test_a_roi_outside_the_image_is_rejected(roi):
    with pytest.raises(InputError, match='is not within 1280 x 960: check the driver'):
        to_camera(info(roi=roi))


@pytest.mark.parametrize('topic, rectified', [
    ('/camera/rgb/image_rect_color', True), ('/zed/rgb/color/rect/image', True),
    ('/camera/image_rect', True), ('rectified/image', True), ('/camera/color/image_raw', False),
    ('/direct/image', False), ('/correct_camera/image', False)])
def test_names_of_rectified_images(topic, rectified):
    assert is_rectified(topic) is rectified


@pytest.mark.parametrize('column', [0, 1])
def test_binning_of_one_axis_leaves_the_other(column):
    camera = to_camera(info(d=[], **{('binning_x', 'binning_y')[column]: 2}))
    whole = to_camera(info(d=[]))
    factors = (2, 1) if column == 0 else (1, 2)
    for names, factor in zip((('width', 'fx', 'cx'), ('height', 'fy', 'cy')), factors):
        for name in names:
            assert getattr(camera, name) * factor == getattr(whole, name)


def test_a_roi_outside_is_described_with_its_size_and_place():
    with pytest.raises(InputError) as raised:
        to_camera(info(roi={'x_offset': 600, 'y_offset': 5, 'width': 800, 'height': 100}))
    assert str(raised.value) == ('the roi of camera_info, 800 x 100 pixels at 600, 5, is not '
                                 'within 1280 x 960: check the driver')
