# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""What Open3D is given, by a stand-in for the library, and what its answers become."""

import sys
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

NAME = 'aick_ros.evaluation.baselines.open3d_odometry'
CAMERA = Camera(40, 30, 50.0, 51.0, 19.0, 14.5)
COLOUR = np.random.default_rng(1).integers(0, 256, (30, 40, 3), np.uint8)
MOTION = np.eye(4) + np.eye(4, k=3)


def namespace(**parts):
    return SimpleNamespace(**parts)


@pytest.fixture
def given():
    """Return what the library was given; ``answers`` are those of its two methods."""
    return namespace(answers=[(True, MOTION, None), MOTION])


@pytest.fixture
def methods(monkeypatch, given):
    def hybrid(source, target, intrinsics, start, term, option):
        given.pair, given.intrinsics, given.start = (source, target), intrinsics, start
        given.option = option
        return given.answers[0]

    def plane(source, target, matrix, **options):
        given.pair, given.matrix, given.options = (source, target), matrix, options
        if isinstance(given.answers[1], Exception):
            raise given.answers[1]
        return namespace(transformation=namespace(numpy=lambda: given.answers[1]))

    library = namespace(
        geometry=namespace(Image=lambda pixels: pixels, RGBDImage=namespace(
            create_from_color_and_depth=lambda colour, depth, **options: (
                colour, depth, options))),
        camera=namespace(PinholeCameraIntrinsic=lambda *numbers: numbers),
        core=namespace(Tensor=lambda array: array),
        pipelines=namespace(odometry=namespace(
            OdometryOption=lambda depth_max: depth_max, compute_rgbd_odometry=hybrid,
            RGBDOdometryJacobianFromHybridTerm=lambda: 'hybrid')),
        t=namespace(
            geometry=namespace(Image=lambda pixels: pixels, RGBDImage=lambda *both: both),
            pipelines=namespace(odometry=namespace(
                rgbd_odometry_multi_scale=plane, OdometryConvergenceCriteria=lambda n: n,
                Method=namespace(PointToPlane='plane')))))
    monkeypatch.setitem(sys.modules, 'open3d', library)
    monkeypatch.delitem(sys.modules, NAME, raising=False)
    module = import_module(NAME)
    yield [module.Open3dHybrid(), module.Open3dPlane()]
    sys.modules.pop(NAME)


def frame(valid=1200, colour=COLOUR):
    depth = np.full(1200, np.nan, np.float32)
    depth[:valid] = 2.0
    return RgbdFrame(1, colour, depth.reshape(30, 40), CAMERA)


def test_images_are_colour_and_depth_in_metres_and_nothing_is_zero(methods):
    hybrid, plane = methods
    (colour, depth, options), camera = hybrid.prepare(frame(600))
    assert camera == CAMERA
    assert options == {'depth_scale': 1.0, 'depth_trunc': 4.0, 'convert_rgb_to_intensity': True}
    images, matrix = plane.prepare(frame(600))
    np.testing.assert_array_equal(matrix, CAMERA.matrix)
    for pixels, distances in ((colour, depth), images):
        np.testing.assert_array_equal(pixels, COLOUR)
        np.testing.assert_array_equal(distances.ravel(), [*600 * [2.0], *600 * [0.0]])


def test_grey_is_of_three_equal_channels_where_that_is_required(methods):
    grey = COLOUR[:, :, 0].copy()
    (colour, _), _ = methods[1].prepare(frame(colour=grey))
    np.testing.assert_array_equal(colour, np.dstack([grey, grey, grey]))


@pytest.mark.parametrize('valid, is_enough', [(0, False), (99, False), (100, True)])
def test_a_hundred_depths_are_required_of_both_frames(methods, valid, is_enough):
    for method in methods:
        some, all_ = method.prepare(frame(valid)), method.prepare(frame())
        for pair in ((some, all_), (all_, some)):
            estimate = method.register(*pair)
            assert (estimate.T_target_source is not None) is is_enough
            assert estimate.failure == ('' if is_enough else 'too few depths')


def test_the_source_comes_first_and_the_camera_is_that_of_the_images(methods, given):
    for method in methods:
        estimate = method.register(('source', CAMERA), ('target', None))
        assert given.pair == ('source', 'target')
        np.testing.assert_array_equal(estimate.T_target_source, MOTION)
    assert given.intrinsics == (40, 30, 50.0, 51.0, 19.0, 14.5) and given.option == 4.0
    np.testing.assert_array_equal(given.start, np.eye(4))
    assert given.matrix == CAMERA
    assert given.options == {'depth_scale': 1.0, 'depth_max': 4.0, 'method': 'plane',
                             'criteria_list': [20, 10, 5]}


@pytest.mark.parametrize('answers', [
    [(False, MOTION, None), RuntimeError('singular')],
    [(True, np.full((4, 4), np.nan), None), np.full((4, 4), np.inf)]])
def test_what_is_no_motion_is_a_failure(methods, given, answers):
    given.answers = answers
    for method in methods:
        estimate = method.register(('source', CAMERA), ('target', CAMERA))
        assert (estimate.T_target_source, estimate.failure) == (
            None, 'Open3D found no transform')
