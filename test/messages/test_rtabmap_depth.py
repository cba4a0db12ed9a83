# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Depth in the compression of RTAB-Map: what was encoded comes back, the rest is rejected."""

import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.messages.compressed_image import decode_depth

RNG = np.random.default_rng(3)
MILLIMETRES = RNG.integers(0, 9000, (24, 32), np.uint16)
METRES = RNG.uniform(0.3, 9.0, (24, 32)).astype(np.float32)
METRES[0, :4] = np.nan, np.inf, 0.0, -1.0


def message(format_, data):
    return SimpleNamespace(format=format_, data=data)


def png(image):
    return cv2.imencode('.png', image)[1].tobytes()


def rvl(units):
    stream = pytest.importorskip('rvl').compress(units.astype('<u2').tobytes())[4:]
    return b'DEPTHRVL' + struct.pack('<2I', *units.shape[::-1]) + stream


@pytest.mark.parametrize('format_, encode', [
    ('png', png), ('.png', png), ('rvl', rvl), ('.rvl', rvl), (' rvl ', rvl)])
def test_millimetres_come_back(format_, encode):
    depth = decode_depth(message(format_, encode(MILLIMETRES)))
    expected = np.where(MILLIMETRES > 0, MILLIMETRES / 1000, np.nan).astype(np.float32)
    np.testing.assert_array_equal(depth, expected)


def test_numbers_of_32_bits_come_back_bit_for_bit():
    """OpenCV takes the bytes of a number for blue, green, red and alpha."""
    bytes_of_numbers = METRES.view(np.uint8).reshape(24, 32, 4)
    depth = decode_depth(message('png', png(bytes_of_numbers)))
    expected = METRES.copy()
    expected[0, :4] = np.nan
    np.testing.assert_array_equal(depth, expected)


@pytest.mark.parametrize('format_, data, reason', [
    ('png:10:100', png(MILLIMETRES), '^the depth image has format .png:10:100., which is '
     'quantised in a way that is not known here: set depth_compression_format of its publisher to '
     '.png or .rvl$'),
    ('rvl:10:100', b'', 'quantised'),
    ('rvl', b'DEPTHRVL' + bytes(7), '^its 15 bytes of RVL data are truncated: record it again$'),
    ('rvl', b'DEPTHRVL' + struct.pack('<2I', 32, 24), 'truncated'),
    ('rvl', b'DEPTHRVL' + struct.pack('<2I', 2 ** 31, 2 ** 31), 'so it is damaged'),
    ('png', b'', 'it is empty'),
    ('png', png(METRES.view(np.uint8).reshape(24, 32, 4))[:-9], 'truncated'),
    ('png', png(RNG.integers(0, 256, (24, 32, 3), np.uint8)), '3 channels of uint8'),
    ('jpg', png(MILLIMETRES)[12:], 'neither PNG nor JPEG')])
def test_what_cannot_be_decoded_is_rejected(format_, data, reason):
    with pytest.raises(InputError, match=reason):
        decode_depth(message(format_, data))


def test_four_channels_of_image_transport_are_a_picture():
    """Of the topic of a colour camera, for instance; their bytes are no depth."""
    with pytest.raises(InputError, match='4 channels of uint8'):
        decode_depth(message('rgba8; png compressed bgra8',
                             png(RNG.integers(0, 256, (24, 32, 4), np.uint8))))
