# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data: what OpenCV encoded is decoded, what is damaged is rejected."""

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.messages import png_jpeg

RNG = np.random.default_rng(1)
GREY = RNG.integers(0, 256, (24, 32), np.uint8)
BGR = RNG.integers(0, 256, (24, 32, 3), np.uint8)
DEPTH = RNG.integers(0, 65536, (24, 32), np.uint16)


def encoded(image, kind='.png'):
    return cv2.imencode(kind, image)[1].tobytes()


def test_png_colours_come_back_in_rgb_order():
    assert np.array_equal(png_jpeg.decode_colour(encoded(BGR)), BGR[:, :, ::-1])


def test_jpeg_colours_come_back_in_rgb_order():
    flat = np.full((16, 16, 3), (10, 80, 220), np.uint8)
    decoded = png_jpeg.decode_colour(encoded(flat, '.jpg'))
    assert np.allclose(decoded, (220, 80, 10), atol=4)


def test_grey_stays_grey():
    assert np.array_equal(png_jpeg.decode_colour(encoded(GREY)), GREY)


def test_alpha_is_dropped():
    bgra = np.dstack([BGR, GREY])
    assert np.array_equal(png_jpeg.decode_colour(encoded(bgra)), BGR[:, :, ::-1])


def test_16_bits_are_scaled_to_the_full_range_of_8():
    decoded = png_jpeg.decode_colour(encoded(DEPTH))
    assert np.array_equal(decoded, np.rint(DEPTH / 257.0))


def test_units_are_left_as_they_are():
    assert np.array_equal(png_jpeg.decode_units(encoded(DEPTH)), DEPTH)


@pytest.mark.parametrize('image', [GREY, BGR])
def test_units_of_a_colour_image_are_rejected(image):
    with pytest.raises(InputError, match='channels of uint8.*use the depth'):
        png_jpeg.decode_units(encoded(image))


@pytest.mark.parametrize('kind, name', [('.png', 'PNG'), ('.jpg', 'JPEG')])
def test_truncated_data_is_rejected_at_any_length(kind, name):
    data = encoded(BGR, kind)
    for length in range(20, len(data) - 1, 97):
        with pytest.raises(InputError, match=f'its {length} bytes of {name} data are truncated'):
            png_jpeg.decode(data[:length])


def test_png_with_a_flipped_byte_is_rejected():
    data = bytearray(encoded(DEPTH))
    data[len(data) // 2] ^= 0xff
    with pytest.raises(InputError, match='bytes of PNG data are damaged'):
        png_jpeg.decode(data)


def test_no_data_is_rejected():
    with pytest.raises(InputError, match='it is empty: copy or record it again'):
        png_jpeg.decode(b'')


@pytest.mark.parametrize('data', [b'\x00' * 100, b'P5 2 2 255 abcd'])
def test_other_data_is_rejected(data):
    with pytest.raises(InputError, match=f'its {len(data)} bytes are neither PNG nor JPEG'):
        png_jpeg.decode(data)
