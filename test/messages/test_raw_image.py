# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Image messages: against a decoder that reads pixel by pixel."""

import array
import dataclasses
import math
import struct

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.messages import raw_image

HEIGHT, WIDTH = 6, 8
SIZES = {'rgb8': 3, 'bgr8': 3, '8UC3': 3, 'rgba8': 4, 'bgra8': 4, '8UC4': 4, 'mono8': 1,
         '8UC1': 1, 'mono16': 2, '16UC1': 2, '32FC1': 4, 'yuv422': 2, 'uyvy': 2,
         'yuv422_yuy2': 2, 'yuyv': 2, 'rgb16': 6, 'bgr16': 6,
         **{f'bayer_{pattern}{bits}': bits // 8 for bits in (8, 16)
            for pattern in ('rggb', 'bggr', 'gbrg', 'grbg')}}
"""Bytes per pixel."""


def message(encoding, padding=0, is_bigendian=0, container=lambda data: data, pixels=None):
    """Return a message of random pixels, or of the bytes of some."""
    row = WIDTH * SIZES[encoding]
    content = np.random.default_rng(2).integers(0, 256, (HEIGHT, row + padding), np.uint8)
    if pixels is not None:
        content[:, :row] = np.frombuffer(pixels, np.uint8).reshape(HEIGHT, row)
    return raw_image.ImageFields(HEIGHT, WIDTH, encoding, is_bigendian, row + padding,
                                 container(content.ravel()))


def pixel_bytes(image, row, column):
    """Return the bytes of one pixel."""
    size = SIZES[image.encoding]
    start = row * image.step + column * size
    return bytes(image.data)[start:start + size]


def slow_colour(image, row, column):
    """Return the pixel as red, green, blue or as grey."""
    content = pixel_bytes(image, row, column)
    if image.encoding in ('bgr8', '8UC3', 'bgra8', '8UC4'):
        return content[2::-1]
    if image.encoding in ('mono16', 'rgb16', 'bgr16'):
        order = '>' if image.is_bigendian else '<'
        values = struct.unpack(f'{order}{len(content) // 2}H', content)
        values = values[::-1] if image.encoding == 'bgr16' else values
        return bytes(round(value / 257) for value in values)
    return content[:3]


def slow_depth(image, row, column):
    """Return the depth [m], NaN for none."""
    content = pixel_bytes(image, row, column)
    order = '>' if image.is_bigendian else '<'
    if image.encoding == '32FC1':
        depth = struct.unpack(order + 'f', content)[0]
    else:
        depth = struct.unpack(order + 'H', content)[0] / 1000
    return depth if 0 < depth < math.inf else math.nan


@pytest.mark.parametrize('padding', [0, 5])
@pytest.mark.parametrize('is_bigendian', [0, 1])
@pytest.mark.parametrize('encoding', [
    'rgb8', 'bgr8', '8UC3', 'rgba8', 'bgra8', '8UC4', 'mono8', '8UC1', 'mono16',
    'rgb16', 'bgr16'])
def test_colour_equals_the_slow_decoder(encoding, is_bigendian, padding):
    image = message(encoding, padding, is_bigendian)
    colour = raw_image.decode_colour(image)
    assert colour.dtype == np.uint8
    assert colour.shape[:2] == (HEIGHT, WIDTH)
    for row in range(HEIGHT):
        for column in range(WIDTH):
            assert bytes(colour[row, column].reshape(-1)) == slow_colour(image, row, column)


@pytest.mark.parametrize('padding', [0, 3, 4])
@pytest.mark.parametrize('is_bigendian', [0, 1])
@pytest.mark.parametrize('encoding', ['16UC1', 'mono16', '32FC1'])
def test_depth_equals_the_slow_decoder(encoding, is_bigendian, padding):
    order = '>' if is_bigendian else '<'
    values = np.random.default_rng(3).uniform(0.3, 9.0, HEIGHT * WIDTH)
    if encoding == '32FC1':
        values[:5] = 0.0, -1.0, math.inf, -math.inf, math.nan
        pixels = values.astype(order + 'f4').tobytes()
    else:
        values[0] = 0.0
        pixels = (values * 1000).astype(order + 'u2').tobytes()
    image = message(encoding, padding, is_bigendian, pixels=pixels)
    depth = raw_image.decode_depth(image)
    expected = [[slow_depth(image, row, column) for column in range(WIDTH)]
                for row in range(HEIGHT)]
    assert depth.dtype == np.float32 and depth.dtype.isnative
    assert np.array_equal(depth, np.array(expected, np.float32), equal_nan=True)
    assert np.isnan(depth[0, 0])


@pytest.mark.parametrize('padding', [0, 6])
@pytest.mark.parametrize('encoding, luma, u, v', [
    ('yuv422', 1, 0, 2), ('uyvy', 1, 0, 2), ('yuv422_yuy2', 0, 1, 3), ('yuyv', 0, 1, 3)])
def test_yuv_is_converted_by_bt_601(encoding, luma, u, v, padding):
    rng = np.random.default_rng(4)
    pairs = np.empty((HEIGHT, WIDTH // 2, 4), np.uint8)
    pairs[..., luma::2] = rng.integers(60, 190, (HEIGHT, WIDTH // 2, 2))
    pairs[..., [u, v]] = rng.integers(100, 156, (HEIGHT, WIDTH // 2, 2))
    colour = raw_image.decode_colour(message(encoding, padding, pixels=pairs.tobytes()))
    for row in range(HEIGHT):
        for column in range(WIDTH):
            y, blue, red = (float(pairs[row, column // 2, index])
                            for index in (luma + 2 * (column % 2), u, v))
            y, blue, red = 1.164 * (y - 16), blue - 128, red - 128
            expected = (y + 1.596 * red, y - 0.392 * blue - 0.813 * red, y + 2.017 * blue)
            assert np.allclose(colour[row, column], expected, atol=2)


@pytest.mark.parametrize('padding', [0, 3])
@pytest.mark.parametrize('dtype', ['u1', '<u2', '>u2'])
@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
def test_bayer_reproduces_a_uniform_colour(pattern, dtype, padding):
    colour = {'r': 200, 'g': 120, 'b': 40}
    tile = np.array([colour[letter] for letter in pattern]).reshape(2, 2)
    mosaic = np.tile(tile, (HEIGHT // 2, WIDTH // 2)).astype(dtype)
    if mosaic.itemsize == 2:
        mosaic *= 257
    image = message(f'bayer_{pattern}{8 * mosaic.itemsize}', padding, int(dtype == '>u2'),
                    pixels=mosaic.tobytes())
    assert (raw_image.decode_colour(image) == (200, 120, 40)).all()


@pytest.mark.parametrize('container', [
    lambda data: data, lambda data: array.array('B', data.tobytes()), lambda data: data.tobytes()])
@pytest.mark.parametrize('padding', [0, 5])
@pytest.mark.parametrize('encoding', ['rgb8', 'mono8', '8UC1'])
def test_an_encoding_without_conversion_is_a_view(encoding, padding, container):
    image = message(encoding, padding, container=container)
    colour = raw_image.decode_colour(image)
    assert np.shares_memory(colour, np.frombuffer(image.data, np.uint8))


def test_every_known_encoding_has_a_size_here():
    known = {*raw_image.COLOUR_ENCODINGS, *raw_image.DEPTH_ENCODINGS}
    assert set(SIZES) == known


@pytest.mark.parametrize('decode, encoding', [
    (raw_image.decode_colour, 'rgb8'), (raw_image.decode_depth, '16UC1')])
@pytest.mark.parametrize('changes, reason', [
    ({'height': 0}, '8 x 0 pixels'),
    ({'width': 0}, '0 x 6 pixels'),
    ({'step': 7}, '^rows of the image have step 7, and 8 pixels of .* need (24|16) '
     'bytes: check the driver$'),
    ({'data': np.zeros(90, np.uint8)}, 'has 90 bytes, and 6 rows of (24|16) need (144|96)'),
    ({'data': b''}, 'has 0 bytes'),
    ({'encoding': 'rgb9'}, "unknown encoding 'rgb9': known are .*(bgr8|32FC1)"),
    ({'encoding': ''}, "unknown encoding ''"),
    ({'encoding': 'x' * 10 ** 6}, "unknown encoding '[x .0-9a-z\\[\\]]{300,350}': known are "),
])
def test_fields_that_contradict_each_other_are_rejected(decode, encoding, changes, reason):
    image = dataclasses.replace(message(encoding), **changes)
    with pytest.raises(InputError, match=reason):
        decode(image)


@pytest.mark.parametrize('missing', [1, 5])
@pytest.mark.parametrize('decode, encoding', [
    (raw_image.decode_colour, 'rgb8'), (raw_image.decode_depth, '16UC1')])
def test_a_last_row_without_its_padding_is_rejected(decode, encoding, missing):
    image = message(encoding, padding=5)
    with pytest.raises(InputError, match=f'has {image.data.size - missing} bytes, and 6 rows of'):
        decode(dataclasses.replace(image, data=image.data[:-missing]))


def test_yuv_of_odd_width_is_rejected():
    image = raw_image.ImageFields(2, 3, 'yuyv', 0, 6, np.zeros(12, np.uint8))
    with pytest.raises(InputError, match=(
            '^the image is 3 pixels wide, and yuyv stores them in pairs: '
            'check the driver$')):
        raw_image.decode_colour(image)


def test_data_after_the_last_row_is_ignored():
    image = message('mono8')
    longer = dataclasses.replace(image, data=np.append(image.data, 7).astype(np.uint8))
    assert np.array_equal(raw_image.decode_colour(longer), raw_image.decode_colour(image))


def test_depth_instead_of_colour_is_rejected():
    with pytest.raises(InputError, match=(
            'the colour image has encoding 16UC1, which is depth: use the '
            'topic of the colour image$')):
        raw_image.decode_colour(message('16UC1'))


def test_colour_instead_of_depth_is_rejected():
    with pytest.raises(InputError, match=(
            'the depth image has encoding bgr8, which is colour: use the '
            'topic of the depth image$')):
        raw_image.decode_depth(message('bgr8'))


RNG = np.random.default_rng(5)
BGR = RNG.integers(0, 256, (48, 64, 3), np.uint8)


@pytest.mark.parametrize('image', [BGR, BGR[:, :, 0], BGR[::-1, ::2]])
def test_encoded_colour_comes_back(image):
    fields = raw_image.encode_colour(image)
    assert fields.data.dtype == np.uint8 and fields.data.ndim == 1
    assert np.array_equal(raw_image.decode_colour(fields), image)


def test_encoded_metres_come_back_bit_for_bit():
    depth = RNG.uniform(0.3, 9, (48, 64)).astype(np.float32)
    depth[3, 4] = np.nan
    decoded = raw_image.decode_depth(raw_image.encode_depth(depth))
    assert np.array_equal(decoded, depth, equal_nan=True)


def test_encoded_millimetres_come_back_rounded():
    depth = RNG.uniform(0.3, 9, (48, 64)).astype(np.float32)
    depth[3, 4] = np.nan
    decoded = raw_image.decode_depth(raw_image.encode_depth(depth, '16UC1'))
    assert np.isnan(decoded[3, 4]) and np.isnan(decoded).sum() == 1
    assert np.nanmax(np.abs(decoded - depth)) <= 0.000501


def test_depth_in_another_encoding_is_rejected():
    with pytest.raises(InputError, match=(
            "^depth cannot be encoded as '64FC1': use 32FC1 or 16UC1$")):
        raw_image.encode_depth(np.ones((2, 2), np.float32), '64FC1')
