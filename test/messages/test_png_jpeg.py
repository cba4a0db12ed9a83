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

from aick_ros.borders.limits import MAX_SCANS, MAX_SIDE
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
@pytest.mark.parametrize('width, height', [(30_000, 30_000), (32_768, 1), (4096, 4097)])
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
    with pytest.raises(InputError, match=f'its {len(data)} bytes are neither PNG nor JPEG data: '
                                         'store the image in one of these formats$'):
        png_jpeg.decode(data)


def segment(marker, content=bytes(30)):
    """Return a segment of JPEG data, with its length (ITU-T T.81, B.1.1.4)."""
    return bytes([0xff, marker]) + struct.pack('>H', 2 + len(content)) + content


@pytest.mark.parametrize('before', [
    b'', segment(0xc4), segment(0xc8), segment(0xcc), segment(0xdb), segment(0xe0), segment(0xfe),
    b'\xff\x01', *(bytes([0xff, marker]) for marker in range(0xd0, 0xd8)),
    b'\xff' + segment(0xc4)],
    ids=lambda before: before[:3].hex())
@pytest.mark.parametrize('frame', sorted(set(range(0xc0, 0xd0)) - {0xc4, 0xc8, 0xcc}))
def test_the_size_is_that_of_the_frame_header_whatever_comes_before(before, frame, monkeypatch):
    """Markers by Table B.1: c4, c8 and cc are no frames, 01 and d0 to d7 stand alone."""
    monkeypatch.setattr(cv2, 'imdecode', None)
    header = segment(frame, struct.pack('>BHHB', 8, 40_000, 50_000, 1) + bytes(3))
    with pytest.raises(InputError, match='JPEG data is declared as 50000 x 40000 pixels'):
        png_jpeg.decode(b'\xff\xd8\xff\xe0\0\2' + before + header + b'\xff\xd9')


@pytest.mark.parametrize('options', [
    [cv2.IMWRITE_JPEG_PROGRESSIVE, 1], [cv2.IMWRITE_JPEG_OPTIMIZE, 1],
    [cv2.IMWRITE_JPEG_RST_INTERVAL, 2]])
def test_other_kinds_of_jpeg_are_read(options):
    data = cv2.imencode('.jpg', BGR, [cv2.IMWRITE_JPEG_QUALITY, 100, *options])[1].tobytes()
    expected = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    np.testing.assert_array_equal(png_jpeg.decode_colour(data), expected[..., ::-1])


def chunk(kind, content, damage=0):
    return (struct.pack('>I', len(content)) + kind + content
            + struct.pack('>I', zlib.crc32(kind + content) ^ damage))


@pytest.mark.parametrize('kind, damage, is_read', [
    (b'tEXt', 0, True), (b'tEXt', 1, True), (b'ABCD', 1, False)])
def test_damage_counts_in_critical_chunks_only(kind, damage, is_read, capfd):
    """As PNG defines: a chunk that starts with a small letter is ancillary."""
    data = encoded(DEPTH)
    damaged = data[:33] + chunk(kind, b'a\0b', damage) + data[33:]
    if is_read:
        np.testing.assert_array_equal(png_jpeg.decode(damaged), DEPTH)
    else:
        with pytest.raises(InputError, match='PNG data are damaged'):
            png_jpeg.decode(damaged)


PACKED = {b'zTXt': b'k\0\0', b'iTXt': b'k\0\1\0\0\0', b'iCCP': b'k\0\0', b'tEXt': b'k\0'}


@pytest.mark.parametrize('kind', PACKED)
@pytest.mark.parametrize('is_after', [False, True])
def test_texts_of_a_png_are_not_unpacked(kind, is_after, monkeypatch):
    """Some kilobytes of them would take seconds."""
    text = chunk(kind, PACKED[kind] + zlib.compress(bytes(10_000)))
    data, place = encoded(DEPTH), -12 if is_after else 33
    given, decode = [], cv2.imdecode
    monkeypatch.setattr(png_jpeg.cv2, 'imdecode', lambda *arguments: (
        given.append(arguments[0].tobytes()), decode(*arguments))[1])
    assert np.array_equal(png_jpeg.decode(data[:place] + 3 * text + data[place:]), DEPTH)
    assert given == [data]


@pytest.mark.parametrize('scans, is_read', [(MAX_SCANS, True), (MAX_SCANS + 1, False)])
def test_a_jpeg_has_a_limit_of_scans(scans, is_read):
    """Each of a few bytes may be one of all pixels."""
    data = cv2.imencode('.jpg', np.zeros((64, 64), np.uint8),
                        [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])[1].tobytes()
    last = data[data.rindex(b'\xff\xda'):-2]
    data = data[:-2] + last * (scans - data.count(b'\xff\xda')) + data[-2:]
    if is_read:
        assert not png_jpeg.decode(data).any()
    else:
        with pytest.raises(InputError) as raised:
            png_jpeg.decode(data)
        assert str(raised.value) == 'its JPEG data has more than 100 scans: store the image again'


def test_data_after_the_end_of_a_png_is_ignored():
    np.testing.assert_array_equal(png_jpeg.decode(encoded(DEPTH) + bytes(20)), DEPTH)


@pytest.mark.parametrize('width, height', [(MAX_SIDE, 1), (1, MAX_SIDE), (4096, 4096)])
def test_the_largest_images_are_not_rejected_by_their_size(width, height):
    """But as damaged: they have the pixels of a small one."""
    for kind in ('.png', '.jpg'):
        try:
            assert png_jpeg.decode(declared(kind, width, height)).shape[:2] == (height, width)
        except InputError as error:
            assert 'declared as' not in str(error)


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


@pytest.mark.parametrize('length', [0, 4, 12, 14])
def test_a_header_of_another_length_is_damage(length):
    data = b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', bytes(length))
    for content in (data, data + chunk(b'IEND', b'')):
        with pytest.raises(InputError, match='bytes of PNG data are (truncated|damaged)'):
            png_jpeg.decode(content)
