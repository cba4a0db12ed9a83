# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""RGB-D frames: images that do not belong together are rejected."""

import dataclasses

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.frames.depth import filled
from aick_ros.frames.imu import ImuSamples
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

CAMERA = Camera(640, 480, 525, 525, 319.5, 239.5)
COLOUR = np.zeros((480, 640, 3), np.uint8)
DEPTH = np.ones((480, 640), np.float32)


@pytest.mark.parametrize('changes, sentence', [
    ({'depth': DEPTH[::2, ::2]}, 'colour is 640 x 480 and depth 320 x 240 pixels'),
    ({'camera': dataclasses.replace(CAMERA, width=1280, height=720)}, 'calibrated for 1280 x 720'),
    ({'colour': COLOUR.astype(np.uint16)}, 'the colour image is uint16'),
    ({'colour': np.zeros((480, 640, 4), np.uint8)}, 'uint8 of shape HxW or HxWx3 is required'),
    ({'depth': DEPTH.astype(np.float64)}, 'the depth image is float64'),
    ({'colour': COLOUR.tolist()[0]}, 'the colour image is a list: a NumPy array is required'),
    ({'depth': None}, 'the depth image is a NoneType'),
    ({'stamp': 1.5}, 'colour image: 1.5, where a 64-bit whole number'),
    ({'stamp': 2 ** 63}, 'where a 64-bit whole number is required'),
    ({'depth_stamp': -2 ** 70}, 'where a 64-bit whole number is required'),
    ({'colour': COLOUR[0, :, 0]}, 'uint8 of shape HxW or HxWx3 is required'),
    ({'colour': COLOUR[0, 0, 0]}, 'the colour image is a uint8'),
    ({'colour': COLOUR[..., None]}, 'uint8 of shape HxW or HxWx3 is required'),
    ({'camera': None}, 'the camera: None, where an object of the class Camera is required'),
    ({'depth': COLOUR}, 'float32 of shape HxW, in metres, is required'),
])
def test_images_of_wrong_type_or_size_are_rejected(changes, sentence):
    fields = {'stamp': 0, 'colour': COLOUR, 'depth': DEPTH, 'camera': CAMERA, **changes}
    with pytest.raises(InputError, match=sentence):
        RgbdFrame(**fields)


def test_grey_is_the_luma_of_the_colour_image():
    """ITU-R BT.601, written out; a grey image is returned as it is."""
    colour = np.random.default_rng(0).integers(0, 256, COLOUR.shape, dtype=np.uint8)
    frame = RgbdFrame(0, colour, DEPTH, CAMERA)
    assert frame.grey.dtype == np.uint8
    np.testing.assert_allclose(frame.grey, colour @ (0.299, 0.587, 0.114), atol=0.6)
    assert dataclasses.replace(frame, colour=frame.grey).grey.shape == DEPTH.shape


def test_an_owned_frame_is_a_copy_whose_depth_is_positive_or_nan():
    depth = np.array([[0.5, 0.0, -0.0, -1.0], [np.inf, -np.inf, np.nan, 1e-3]], np.float32)
    colour = np.arange(8, dtype=np.uint8).reshape(2, 4)
    given = depth.copy(), colour.copy()
    frame = RgbdFrame(5, given[1], given[0], Camera(4, 2, 5.0, 5.0, 1.5, 0.5), 7)
    owned = frame.owned()
    nothing = np.nan
    np.testing.assert_array_equal(owned.depth, np.array(
        [[0.5, nothing, nothing, nothing], [nothing, nothing, nothing, 1e-3]], np.float32))
    np.testing.assert_array_equal(given[0], depth)
    for image in given:
        image += 1
    np.testing.assert_array_equal(owned.colour, colour)
    assert (owned.stamp, owned.depth_stamp, owned.camera) == (5, 7, frame.camera)
    for image in (owned.colour, owned.depth):
        with pytest.raises(ValueError, match='read-only'):
            image += 1


def test_images_that_are_handed_over_are_not_copied():
    frame = RgbdFrame(0, COLOUR.copy(), np.where(DEPTH > 0, DEPTH, np.float32(np.nan)), CAMERA)
    assert frame.handed_over() is frame
    owned = frame.owned()
    assert owned.colour is frame.colour and owned.depth is frame.depth
    for image in (frame.colour, frame.depth):
        with pytest.raises(ValueError, match='read-only'):
            image += 1


@pytest.mark.parametrize('wrong', [0.0, -1.0, np.inf, 1e6])
def test_depth_that_is_handed_over_is_nevertheless_checked(wrong):
    depth = np.full(DEPTH.shape, 1.5, np.float32)
    depth[-1, -1] = wrong
    owned = RgbdFrame(0, COLOUR.copy(), depth, CAMERA).handed_over().owned()
    assert np.isnan(owned.depth[-1, -1]) and np.isfinite(owned.depth).sum() == depth.size - 1
    assert depth[-1, -1] == wrong


def test_a_view_of_an_array_that_is_filled_again_is_copied():
    """As of a message: the view is constant, what it shows is not."""
    data = bytearray(COLOUR.tobytes())
    colour = np.frombuffer(data, np.uint8).reshape(COLOUR.shape)
    owned = RgbdFrame(0, colour, DEPTH.copy(), CAMERA).handed_over().owned()
    data[0] ^= 255
    assert owned.colour[0, 0, 0] == COLOUR[0, 0, 0] != colour[0, 0, 0]


def test_images_that_lie_column_by_column_are_copied_row_by_row():
    """As of a camera that is mounted on its side, whose images are turned."""
    depth = np.random.default_rng(2).uniform(1.0, 2.0, (640, 480)).astype(np.float32)
    frames = [RgbdFrame(0, np.asfortranarray(grey), np.asfortranarray(depth.T), CAMERA)
              for grey in 2 * (COLOUR[..., 0],)]
    for owned in (frames[0].handed_over().owned(), frames[1].owned()):
        for image in (owned.colour, owned.depth):
            assert image.flags.c_contiguous and not image.flags.writeable
        np.testing.assert_array_equal(owned.depth, depth.T)
        assert filled(owned.depth).shape == owned.depth.shape


def test_depth_that_no_camera_measures_is_none():
    """As of bytes in another order: its inverse, or its square, is no float32."""
    depth = np.array([[1e-45, 9.9e-6, 1.01e-5, 1.0, 9.9e4, 1.01e5, 3e38, np.nan]], np.float32)
    frame = RgbdFrame(5, np.zeros((1, 8), np.uint8), depth, Camera(8, 1, 5.0, 5.0, 1.5, 0.5))
    assert np.isfinite(frame.owned().depth).tolist() == [[
        False, False, True, True, True, False, False, False]]


@pytest.mark.parametrize('changes, sentence', [
    ({'depth': DEPTH.T}, 'colour is 640 x 480 and depth 480 x 640 pixels: depth must be '
     'registered to the colour camera'),
    ({'depth': DEPTH[::2]}, 'colour is 640 x 480 and depth 640 x 240 pixels: depth must be '
     'registered to the colour camera'),
    ({'camera': dataclasses.replace(CAMERA, width=320)}, 'colour is 640 x 480 pixels and the '
     'camera calibrated for 320 x 480: the calibration must be of the same resolution'),
    ({'depth': DEPTH[0]}, 'the depth image is float32 of shape (640,): float32 of shape HxW, in '
     'metres, is required'),
    ({'colour': COLOUR.view(np.int8)}, 'the colour image is int8 of shape (480, 640, 3): uint8 of '
     'shape HxW or HxWx3 is required'),
    ({'depth_stamp': 0.5}, 'the stamp [ns] of the depth image: 0.5, where a 64-bit whole number '
     'is required'),
    ({'imu': 3}, 'imu: 3, where an object of the class ImuSamples is required')])
def test_the_sentence_names_the_image_and_both_sizes(changes, sentence):
    fields = {'stamp': 0, 'colour': COLOUR, 'depth': DEPTH, 'camera': CAMERA, **changes}
    with pytest.raises(InputError) as raised:
        RgbdFrame(**fields)
    assert str(raised.value) == sentence


def test_the_owner_keeps_the_samples_of_the_imu():
    samples = ImuSamples(np.arange(3), np.zeros((3, 3)), np.ones((3, 3)))
    assert RgbdFrame(0, COLOUR, DEPTH, CAMERA, imu=samples).owned().imu is samples


def test_grey_made_of_colour_cannot_be_changed():
    with pytest.raises(ValueError, match='read-only'):
        RgbdFrame(0, COLOUR, DEPTH, CAMERA).grey[0] = 1
