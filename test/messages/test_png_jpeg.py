# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data to images: what OpenCV encoded comes back, what is none is rejected."""


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
    with pytest.raises(InputError, match='channels? of uint8.*use the depth'):
        png_jpeg.decode_units(encoded(image))


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


@pytest.mark.parametrize('options', [
    [cv2.IMWRITE_JPEG_PROGRESSIVE, 1], [cv2.IMWRITE_JPEG_OPTIMIZE, 1],
    [cv2.IMWRITE_JPEG_RST_INTERVAL, 2]])
def test_other_kinds_of_jpeg_are_read(options):
    data = cv2.imencode('.jpg', BGR, [cv2.IMWRITE_JPEG_QUALITY, 100, *options])[1].tobytes()
    expected = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(png_jpeg.decode_colour(data), expected[..., ::-1])


@pytest.mark.parametrize('image, sentence', [
    (BGR, 'it has 3 channels of uint8'), (GREY, 'it has 1 channel of uint8'),
    (np.dstack([DEPTH] * 3), 'it has 3 channels of uint16')])
def test_what_is_no_depth_is_described(image, sentence):
    with pytest.raises(InputError) as raised:
        png_jpeg.decode_units(encoded(image))
    assert str(raised.value) == (f'{sentence}, a depth image has one of uint16: use the depth '
                                 'image as the camera sends it, not the colour image, nor a '
                                 'depth image made to be looked at')


def test_16_bits_of_any_order_are_scaled():
    for dtype in ('<u2', '>u2'):
        image = DEPTH.astype(dtype)[:, ::3]
        found = png_jpeg.to_8_bit(image)
        assert found.dtype == np.uint8
        np.testing.assert_array_equal(found, np.rint(DEPTH[:, ::3] / 257.0))
