# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Messages to frames: which image is damaged, and cameras that are not those of the images."""

import dataclasses
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.geometry import se3
from aick_ros.geometry.camera import Camera
from aick_ros.messages import frame_decoder
from aick_ros.messages.depth_to_colour import DepthToColour
from aick_ros.messages.frame_decoder import FrameDecoder
from aick_ros.messages.raw_image import encode_colour, encode_depth
from aick_ros.messages.synchronizer import Pair

CAMERA = Camera(64, 48, 52, 52, 31.5, 23.5)
DEPTH_CAMERA = Camera(32, 24, 26, 26, 15.5, 11.5)
COLOUR = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
DEPTH = np.random.default_rng(1).uniform(1.0, 1.02, (24, 32)).astype(np.float32)
T_COLOUR_DEPTH = se3.exp([0.02, 0, 0, 0, 0, 0])


@pytest.fixture
def pair():
    return Pair(100, encode_colour(COLOUR), 101, encode_depth(DEPTH))


def test_registered_depth_is_enlarged_to_the_size_of_colour(pair):
    frame = FrameDecoder().decode(pair, CAMERA)
    assert (frame.stamp, frame.depth_stamp) == (100, 101)
    assert frame.depth.shape == (48, 64)
    np.testing.assert_array_equal(frame.colour, COLOUR)


def test_depth_of_another_camera_is_reprojected_with_the_latest_extrinsic(pair):
    decoder = FrameDecoder()
    for T in (np.eye(4), T_COLOUR_DEPTH):
        frame = decoder.decode_and_reproject(pair, CAMERA, DEPTH_CAMERA, T)
        assert (frame.stamp, frame.depth_stamp, frame.camera) == (100, 101, CAMERA)
        np.testing.assert_array_equal(
            frame.depth, DepthToColour(DEPTH_CAMERA, CAMERA, T).reproject(DEPTH))


def test_compressed_images_are_decoded(pair):
    def png(image):
        return cv2.imencode('.png', image)[1].tobytes()

    colour = SimpleNamespace(format='rgb8; png compressed bgr8', data=png(COLOUR[..., ::-1]))
    millimetres = np.rint(1000 * DEPTH).astype(np.uint16)
    depth = SimpleNamespace(format='16UC1; compressedDepth png',
                            data=bytes(12) + png(millimetres))
    compressed = FrameDecoder().decode(
        pair._replace(colour=colour, depth=depth), CAMERA)
    np.testing.assert_array_equal(compressed.colour, COLOUR)
    rounded = pair._replace(depth=encode_depth(DEPTH, '16UC1'))
    np.testing.assert_array_equal(compressed.depth,
                                  FrameDecoder().decode(rounded, CAMERA).depth)


@pytest.mark.parametrize('kind', ['colour', 'depth'])
def test_the_damaged_image_is_named(pair, kind):
    damaged = dataclasses.replace(getattr(pair, kind), data=np.zeros(9, np.uint8))
    with pytest.raises(InputError, match=f'{kind} at 0.0000001..: the image has 9 bytes'):
        FrameDecoder().decode(pair._replace(**{kind: damaged}), CAMERA)


@pytest.mark.parametrize('cameras, reason', [
    ((DEPTH_CAMERA, DEPTH_CAMERA),
     'colour at 0.000000100: the image is 64 x 48 pixels and its camera calibrated for 32 x'),
    ((CAMERA, dataclasses.replace(DEPTH_CAMERA, width=32_000)),
     'depth at 0.000000101: the image is 32 x 24 pixels and its camera calibrated for 32000'),
])
def test_cameras_of_other_sizes_are_rejected_before_any_work(pair, cameras, reason):
    with pytest.raises(InputError, match=reason):
        FrameDecoder().decode_and_reproject(pair, *cameras, np.eye(4))


@pytest.mark.parametrize('changes', [
    {'camera': dataclasses.replace(CAMERA, fx=40.0)},
    {'depth_camera': dataclasses.replace(DEPTH_CAMERA, fy=20.0)}, {'T': T_COLOUR_DEPTH}])
def test_a_reprojection_is_that_of_these_cameras(pair, changes):
    decoder = FrameDecoder()
    for now in ({}, changes, {}):
        given = {'camera': CAMERA, 'depth_camera': DEPTH_CAMERA, 'T': np.eye(4), **now}
        frame = decoder.decode_and_reproject(pair, *given.values())
        np.testing.assert_array_equal(frame.depth, DepthToColour(
            given['depth_camera'], given['camera'], given['T']).reproject(DEPTH))


@pytest.mark.parametrize('distance, depth, is_rejected', [
    (25.0, DEPTH, True), (1.1, 0.01 * DEPTH, True), (0.9, 0.01 * DEPTH, False),
    (25.0, np.full_like(DEPTH, np.nan), False)])
def test_a_pose_in_millimetres_is_named(pair, distance, depth, is_rejected):
    """Depth that a near camera has elsewhere is none, nor is that of an image without depth."""
    T_colour_depth = se3.exp([-distance, 0, 0, 0, 0, 0])
    pair = pair._replace(depth=encode_depth(depth))

    def depth_of_frame():
        return FrameDecoder().decode_and_reproject(
            pair, CAMERA, DEPTH_CAMERA, T_colour_depth).depth

    if not is_rejected:
        assert np.isnan(depth_of_frame()).all()
        return
    with pytest.raises(InputError, match=(
            'depth at 0.000000101: no depth falls into the colour image, as by its pose the depth '
            f'camera is {distance:g} m from the colour camera: check that the pose is in metres')):
        depth_of_frame()


def test_an_unchanged_reprojection_is_not_made_again(pair, monkeypatch):
    """It takes longer than its use; only the last one is kept."""
    made = []

    def counted(*arguments):
        made.append(arguments)
        return DepthToColour(*arguments)

    monkeypatch.setattr(frame_decoder, 'DepthToColour', counted)
    decoder = FrameDecoder()
    for T in (np.eye(4), np.eye(4), T_COLOUR_DEPTH, T_COLOUR_DEPTH.copy(), np.eye(4)):
        decoder.decode_and_reproject(pair, CAMERA, DEPTH_CAMERA, T)
    assert len(made) == 3


def test_images_are_named_as_the_topics(pair):
    decoder = FrameDecoder(names=('/rgb', '/depth'))
    for kind, name, stamp in (('colour', '/rgb', 100), ('depth', '/depth', 101)):
        damaged = dataclasses.replace(getattr(pair, kind), encoding='none')
        for decode in (lambda pair: decoder.decode(pair, CAMERA),
                       lambda pair: decoder.decode_and_reproject(pair, CAMERA, DEPTH_CAMERA,
                                                                 np.eye(4))):
            with pytest.raises(InputError, match=f"^{name} at 0.000000{stamp}: the {kind} image"):
                decode(pair._replace(**{kind: damaged}))


def test_what_registers_depth_is_named_as_it_is_called(pair):
    """A parameter of the node, an option of the command."""
    smaller = pair._replace(depth=encode_depth(np.ones((20, 30), np.float32)))
    for given, name in (({}, 'register_depth'),
                        ({'register_depth': '--register-depth'}, '--register-depth')):
        with pytest.raises(InputError, match=rf'or register it here \({name}\)$'):
            FrameDecoder(**given).decode(smaller, CAMERA)


def test_a_calibration_of_another_size_is_that_of_colour(pair):
    with pytest.raises(InputError, match='colour at 0.000000100: .* calibrated for 32 x 24'):
        FrameDecoder().decode(pair, DEPTH_CAMERA)
