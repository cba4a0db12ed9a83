# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""PNG and JPEG data: what OpenCV encoded comes back, what is damaged is rejected."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from aick_ros.borders import encoded_image
from aick_ros.borders.encoded_image import decode, format_of
from aick_ros.borders.limits import MAX_SCANS, MAX_SIDE
from aick_ros.errors import InputError

RNG = np.random.default_rng(1)
BGR = RNG.integers(0, 256, (24, 32, 3), np.uint8)
DEPTH = RNG.integers(0, 65536, (24, 32), np.uint16)


def encoded(image, kind='.png'):
    return cv2.imencode(kind, image)[1].tobytes()


@pytest.mark.parametrize('content, name', [
    (encoded(BGR), 'PNG'), (encoded(BGR, '.jpg'), 'JPEG'), (encoded(BGR)[:7], ''),
    (encoded(BGR, '.bmp'), ''), (b'', '')])
def test_a_format_is_told_by_the_first_bytes(content, name):
    assert format_of(content) == name


@pytest.mark.parametrize('kind, name', [('.png', 'PNG'), ('.jpg', 'JPEG')])
def test_truncated_data_is_rejected_at_any_length(kind, name):
    data = encoded(BGR, kind)
    for length in range(20, len(data) - 1, 97):
        with pytest.raises(InputError, match=f'its {length} bytes of {name} data are truncated'):
            decode(data[:length])


def test_png_with_a_flipped_byte_is_rejected():
    data = bytearray(encoded(DEPTH))
    data[len(data) // 2] ^= 0xff
    with pytest.raises(InputError, match='bytes of PNG data are damaged'):
        decode(data)


def test_damaged_data_is_rejected_without_a_word_of_libpng(capfd):
    data = encoded(DEPTH)
    for place in range(8, len(data), 7):
        damaged = bytearray(data)
        damaged[place] ^= 0xff
        with pytest.raises(InputError):
            decode(damaged)
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
        decode(declared(kind, width, height))


@pytest.mark.parametrize('count', [1, 2, 3])
def test_padding_before_a_marker_is_skipped(count):
    """Any number of bytes ff may stand before a marker (ITU-T T.81, B.1.1.2)."""
    data = encoded(BGR, '.jpg')
    place = data.index(b'\xff\xc0')
    padded = data[:place] + count * b'\xff' + data[place:]
    np.testing.assert_array_equal(decode(padded), decode(data))


def test_no_data_is_rejected():
    with pytest.raises(InputError, match='it is empty: copy or record it again'):
        decode(b'')


@pytest.mark.parametrize('data', [b'\x00' * 100, b'P5 2 2 255 abcd'])
def test_other_data_is_rejected(data):
    with pytest.raises(InputError, match=f'its {len(data)} bytes are neither PNG nor JPEG data: '
                                         'store the image in one of these formats$'):
        decode(data)


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
        decode(b'\xff\xd8\xff\xe0\0\2' + before + header + b'\xff\xd9')


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
        np.testing.assert_array_equal(decode(damaged), DEPTH)
    else:
        with pytest.raises(InputError, match='PNG data are damaged'):
            decode(damaged)


PACKED = {b'zTXt': b'k\0\0', b'iTXt': b'k\0\1\0\0\0', b'iCCP': b'k\0\0', b'tEXt': b'k\0'}


@pytest.mark.parametrize('kind', PACKED)
@pytest.mark.parametrize('is_after', [False, True])
def test_texts_of_a_png_are_not_unpacked(kind, is_after, monkeypatch):
    """Some kilobytes of them would take seconds."""
    text = chunk(kind, PACKED[kind] + zlib.compress(bytes(10_000)))
    data, place = encoded(DEPTH), -12 if is_after else 33
    given, imdecode = [], cv2.imdecode
    monkeypatch.setattr(encoded_image.cv2, 'imdecode', lambda *arguments: (
        given.append(arguments[0].tobytes()), imdecode(*arguments))[1])
    assert np.array_equal(decode(data[:place] + 3 * text + data[place:]), DEPTH)
    assert given == [data]


@pytest.mark.parametrize('scans, is_read', [(MAX_SCANS, True), (MAX_SCANS + 1, False)])
def test_a_jpeg_has_a_limit_of_scans(scans, is_read):
    """Each of a few bytes may be one of all pixels."""
    data = cv2.imencode('.jpg', np.zeros((64, 64), np.uint8),
                        [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])[1].tobytes()
    last = data[data.rindex(b'\xff\xda'):-2]
    data = data[:-2] + last * (scans - data.count(b'\xff\xda')) + data[-2:]
    if is_read:
        assert not decode(data).any()
    else:
        with pytest.raises(InputError) as raised:
            decode(data)
        assert str(raised.value) == 'its JPEG data has more than 100 scans: store the image again'


def test_data_after_the_end_of_a_png_is_ignored():
    np.testing.assert_array_equal(decode(encoded(DEPTH) + bytes(20)), DEPTH)


@pytest.mark.parametrize('width, height', [(MAX_SIDE, 1), (1, MAX_SIDE), (4096, 4096)])
def test_the_largest_images_are_not_rejected_by_their_size(width, height):
    """But as damaged: they have the pixels of a small one."""
    for kind in ('.png', '.jpg'):
        try:
            assert decode(declared(kind, width, height)).shape[:2] == (height, width)
        except InputError as error:
            assert 'declared as' not in str(error)


@pytest.mark.parametrize('length', [0, 4, 12, 14])
def test_a_header_of_another_length_is_damage(length):
    data = b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', bytes(length))
    for content in (data, data + chunk(b'IEND', b'')):
        with pytest.raises(InputError, match='bytes of PNG data are (truncated|damaged)'):
            decode(content)
