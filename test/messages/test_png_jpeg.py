# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data: what OpenCV encoded is decoded, what is damaged is rejected."""

import struct
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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


def test_damaged_data_is_rejected_without_a_word_of_libpng(capfd):
    data = encoded(DEPTH)
    for place in range(8, len(data), 7):
        damaged = bytearray(data)
        damaged[place] ^= 0xff
        with pytest.raises(InputError):
            png_jpeg.decode(damaged)
    assert capfd.readouterr().err == ''


def declared(kind, width, height):
    """Return an image whose header declares another size."""
    data = bytearray(encoded(BGR, kind))
    if kind == '.png':
        struct.pack_into('>II', data, 16, width, height)
        struct.pack_into('>I', data, 29, zlib.crc32(data[12:29]))
    else:
        struct.pack_into('>HH', data, data.index(b'\xff\xc0') + 5, height, width)
    return bytes(data)


@pytest.mark.parametrize('kind', ['.png', '.jpg'])
@pytest.mark.parametrize('width, height', [(30_000, 30_000), (32_768, 1), (8192, 4097)])
def test_large_images_are_rejected_by_their_header(kind, width, height, monkeypatch):
    monkeypatch.setattr(cv2, 'imdecode', None)  # nothing is unpacked
    with pytest.raises(InputError, match=f'declared as {width} x {height} pixels: at most'):
        png_jpeg.decode(declared(kind, width, height))


@pytest.mark.parametrize('count', [1, 2, 3])
def test_padding_before_a_marker_is_skipped(count):
    """Any number of bytes ff may stand before a marker (ITU-T T.81, B.1.1.2)."""
    data = encoded(BGR, '.jpg')
    place = data.index(b'\xff\xc0')
    padded = data[:place] + count * b'\xff' + data[place:]
    np.testing.assert_array_equal(png_jpeg.decode(padded), png_jpeg.decode(data))


@pytest.mark.parametrize('kind', ['.png', '.jpg'])
@given(data=st.data())
def test_any_bytes_are_an_image_or_an_input_error(kind, data):
    """Those of an image with some bytes replaced, and any bytes after its signature."""
    valid = encoded(BGR[:4, :6], kind)
    content = bytearray(data.draw(st.just(valid) | st.binary().map(lambda end: valid[:8] + end)))
    for place in data.draw(st.lists(st.integers(0, len(content) - 1), max_size=4)):
        content[place] = data.draw(st.integers(0, 255))
    try:
        image = png_jpeg.decode_colour(content)
    except InputError:
        return
    assert image.dtype == np.uint8 and image.ndim in (2, 3)


def test_no_data_is_rejected():
    with pytest.raises(InputError, match='it is empty: copy or record it again'):
        png_jpeg.decode(b'')


@pytest.mark.parametrize('data', [b'\x00' * 100, b'P5 2 2 255 abcd'])
def test_other_data_is_rejected(data):
    with pytest.raises(InputError, match=f'its {len(data)} bytes are neither PNG nor JPEG'):
        png_jpeg.decode(data)
