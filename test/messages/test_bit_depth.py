# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images of 10 and 12 bits in 16 are as bright as those of 16, and stay so in the dark."""

from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.geometry.camera import Camera
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.messages.frame_decoder import FrameDecoder
from aick_ros.messages.raw_image import ImageFields, encode_depth
from aick_ros.messages.synchronizer import Pair

CAMERA = Camera(64, 48, 52, 52, 31.5, 23.5)
SCENE = np.random.default_rng(0).uniform(0.02, 0.98, (48, 64))
SCENE[3, 4] = 1.0
DEPTH = encode_depth(np.ones((48, 64), np.float32))


def seen(bits, brightness=1.0):
    """Return the scene as a camera of so many bits measures it, HxW uint16."""
    return np.floor(brightness * SCENE * (2 ** bits - 1)).astype(np.uint16)


def raw(samples, is_bigendian):
    stored = samples.astype('>u2' if is_bigendian else '<u2')
    return ImageFields(48, 64, 'mono16', is_bigendian, 128, stored.view(np.uint8).ravel())


def png(samples, _):
    return SimpleNamespace(format='mono16; png compressed ',
                           data=cv2.imencode('.png', samples)[1].tobytes())


@pytest.mark.parametrize('message', [raw, png])
@pytest.mark.parametrize('is_bigendian', [0, 1])
@pytest.mark.parametrize('bits', [10, 12, 14, 16])
def test_images_of_fewer_bits_are_as_bright(bits, is_bigendian, message):
    colour = FrameDecoder().decode(
        Pair(0, message(seen(bits), is_bigendian), 0, DEPTH), CAMERA).colour
    np.testing.assert_allclose(colour, 255 * SCENE, atol=1.0)


def test_a_dark_image_of_a_camera_that_is_known_stays_dark():
    decoder = FrameDecoder()
    bright, dark = (decoder.decode(Pair(0, raw(seen(12, brightness), 0), 0, DEPTH), CAMERA).colour
                    for brightness in (1.0, 0.1))
    np.testing.assert_allclose(dark, 0.1 * bright, atol=1.0)


@pytest.mark.parametrize('largest, shift', [
    (0, 6), (1023, 6), (1024, 4), (4095, 4), (4096, 2), (16383, 2), (16384, 0), (65535, 0)])
def test_the_bits_are_the_fewest_in_which_an_image_has_room(largest, shift):
    samples = np.array([0, largest], np.uint16)
    np.testing.assert_array_equal(BitDepth().full_range(samples), [0, largest << shift])
