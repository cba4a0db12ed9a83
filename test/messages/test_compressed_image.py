# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Compressed image messages: what was encoded is decoded, the rest is rejected."""

import array
import math
import struct
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.messages import compressed_image

RNG = np.random.default_rng(5)
BGR = cv2.GaussianBlur(RNG.integers(0, 256, (48, 64, 3), np.uint8), (0, 0), 3)
MILLIMETRES = RNG.integers(0, 9000, (48, 64), np.uint16)


def compressed(format_, image, kind='.png', header=b'', container=bytes):
    data = header + cv2.imencode(kind, image)[1].tobytes()
    return SimpleNamespace(format=format_, data=container(data))


@pytest.mark.parametrize('container', [
    bytes, lambda data: array.array('B', data), lambda data: np.frombuffer(data, np.uint8)])
@pytest.mark.parametrize('format_, kind', [
    ('rgb8; png compressed bgr8', '.png'), ('bgr8; png compressed bgr8', '.png'),
    ('png', '.png'), ('rgb8; jpeg compressed bgr8', '.jpg'), ('jpeg', '.jpg')])
def test_compressed_colour_comes_back(format_, kind, container):
    colour = compressed_image.decode_colour(
        compressed(format_, BGR, kind, container=container))
    tolerance = 0 if kind == '.png' else 12
    assert np.abs(colour.astype(int) - BGR[:, :, ::-1]).max() <= tolerance


def test_compressed_rgb_that_was_stored_as_rgb_stays_rgb():
    colour = compressed_image.decode_colour(compressed('rgb8; png compressed ', BGR))
    assert np.array_equal(colour, BGR)


def test_compressed_grey_comes_back():
    for format_ in ('mono8; jpeg compressed ', 'rgb8; png compressed '):
        colour = compressed_image.decode_colour(compressed(format_, BGR[:, :, 0]))
        assert np.array_equal(colour, BGR[:, :, 0])


@pytest.mark.parametrize('format_, header', [
    ('16UC1; compressedDepth png', bytes(12)), ('16UC1; compressedDepth', bytes(12)),
    ('16UC1', bytes(12)), ('16UC1; png compressed ', b''), ('png', b'')])
def test_compressed_millimetres_come_back(format_, header):
    depth = compressed_image.decode_depth(compressed(format_, MILLIMETRES, header=header))
    expected = np.where(MILLIMETRES > 0, MILLIMETRES / 1000, np.nan).astype(np.float32)
    assert np.array_equal(depth, expected, equal_nan=True)


def test_compressed_inverse_depth_comes_back_within_its_quantisation():
    metres = RNG.uniform(0.4, 9.5, (48, 64))
    metres[0, :3] = np.nan, np.inf, 11.0
    quantisation, farthest = 100.0, 10.0
    scale = quantisation * (quantisation + 1)
    offset = 1 - scale / farthest
    with np.errstate(invalid='ignore'):
        stored = np.where(metres < farthest, scale / metres + offset, 0).astype(np.uint16)
    header = struct.pack('<iff', 0, scale, offset)
    for format_ in ('32FC1; compressedDepth png', '32FC1; compressedDepth'):
        depth = compressed_image.decode_depth(compressed(format_, stored, header=header))
        assert np.isnan(depth[0, :3]).all()
        # one step of the stored number is depth^2 / A
        error = np.abs(depth - metres)[np.isfinite(depth)]
        assert (error <= 1.01 * (metres ** 2 / scale)[np.isfinite(depth)] + 1e-5).all()
        assert np.isfinite(depth).sum() == depth.size - 3


def test_stored_inverse_depth_of_no_positive_depth_is_none():
    """For B = 100, what is stored up to B is depth at infinity or behind the camera."""
    stored = np.array([[0, 1, 99, 100, 101, 200, 65535]], np.uint16)
    header = struct.pack('<iff', 0, 50.0, 100.0)
    depth = compressed_image.decode_depth(
        compressed('32FC1; compressedDepth png', stored, header=header))
    expected = [[math.nan] * 4 + [50.0, 0.5, 50.0 / 65435]]
    np.testing.assert_allclose(depth, expected, rtol=1e-6)


def test_compressed_inverse_depth_without_quantisation_is_rejected():
    for header in (bytes(12), struct.pack('<iff', 0, math.nan, 0.0), b''):
        with pytest.raises(InputError, match='quantisation A .* must be positive'):
            compressed_image.decode_depth(
                compressed('32FC1; compressedDepth png', MILLIMETRES, header=header))


def test_colour_instead_of_compressed_depth_is_rejected():
    with pytest.raises(InputError, match='3 channels of uint8'):
        compressed_image.decode_depth(
            compressed('rgb8; png compressed bgr8', BGR, header=bytes(12)))


def compressed_by_rvl(units, header=bytes(12)):
    """Return the data of a message as compressed_depth_image_transport lays it out."""
    height, width = units.shape
    stream = pytest.importorskip('rvl').compress(units.astype('<u2').tobytes())[4:]
    return header + struct.pack('<2I', width, height) + stream


@pytest.mark.parametrize('container', [bytes, lambda data: array.array('B', data)])
def test_millimetres_compressed_by_rvl_come_back(container):
    depth = compressed_image.decode_depth(SimpleNamespace(
        format='16UC1; compressedDepth rvl', data=container(compressed_by_rvl(MILLIMETRES))))
    expected = np.where(MILLIMETRES > 0, MILLIMETRES / 1000, np.nan).astype(np.float32)
    assert np.array_equal(depth, expected, equal_nan=True)


def test_inverse_depth_compressed_by_rvl_is_that_compressed_by_png():
    header = struct.pack('<iff', 0, 10100.0, -1009.0)
    by_rvl, by_png = (compressed_image.decode_depth(message) for message in (
        SimpleNamespace(format='32FC1;compressedDepth rvl',
                        data=compressed_by_rvl(MILLIMETRES, header)),
        compressed('32FC1; compressedDepth png', MILLIMETRES, header=header)))
    assert np.isfinite(by_rvl).any()
    assert np.array_equal(by_rvl, by_png, equal_nan=True)


@pytest.mark.parametrize('size, reason', [
    (0, 'and 0 bytes, fewer than the 20 of its header: it is truncated; record it again$'),
    (19, '19 bytes'),
    (20, 'RVL data is truncated'), (200, 'RVL data is truncated')])
def test_truncated_rvl_is_rejected(size, reason):
    with pytest.raises(InputError, match=reason):
        compressed_image.decode_depth(SimpleNamespace(
            format='16UC1; compressedDepth rvl', data=compressed_by_rvl(MILLIMETRES)[:size]))


@pytest.mark.parametrize('format_', ['16UC1; compressedDepth png', '32FC1; compressedDepth',
                                     '16UC1; png compressed '])
def test_compressed_depth_instead_of_colour_is_rejected(format_):
    with pytest.raises(InputError, match='which is depth'):
        compressed_image.decode_colour(compressed(format_, MILLIMETRES, header=bytes(12)))


@pytest.mark.parametrize('decode', [
    compressed_image.decode_colour, compressed_image.decode_depth])
@pytest.mark.parametrize('data, reason', [
    (b'', 'it is empty: copy or record it again'), (b'\x01' * 11, 'neither PNG nor JPEG'),
    (b'\x01' * 500, 'neither PNG nor JPEG'),
    (cv2.imencode('.png', MILLIMETRES)[1].tobytes()[:900], '900 bytes of PNG data are truncated')])
def test_damaged_compressed_data_is_rejected(decode, data, reason):
    with pytest.raises(InputError, match=reason):
        decode(SimpleNamespace(format='', data=data))


@pytest.mark.parametrize('size', [11, 12, 13])
def test_a_header_of_compressed_depth_has_twelve_bytes(size):
    png = cv2.imencode('.png', MILLIMETRES)[1].tobytes()
    message = SimpleNamespace(format='16UC1; compressedDepth', data=bytes(size) + png)
    if size == 12:
        assert compressed_image.decode_depth(message).shape == MILLIMETRES.shape
    else:
        with pytest.raises(InputError, match='neither PNG nor JPEG'):
            compressed_image.decode_depth(message)


@pytest.mark.parametrize('format_, scale, offset', [
    ('32FC1; compressedDepth png', -2.0, 3.5), ('32FC1;compressedDepth', 0.0, 1.5)])
def test_the_sentence_about_quantisation_has_both_numbers_in_order(format_, scale, offset):
    header = struct.pack('<iff', 0, scale, offset)
    with pytest.raises(InputError) as raised:
        compressed_image.decode_depth(compressed(format_, MILLIMETRES, header=header))
    assert str(raised.value) == (
        f'the depth image has format {format_!r} and quantisation A {scale:g}, B {offset:g}: A '
        'must be positive; check the publisher')


def test_a_format_may_begin_with_a_space():
    header = struct.pack('<iff', 0, 50.0, 0.0)
    units = np.array([[25, 0], [100, 50]], np.uint16)
    depth = compressed_image.decode_depth(compressed(' 32FC1; compressedDepth png', units,
                                                     header=header))
    np.testing.assert_array_equal(depth, np.float32([[2.0, np.nan], [0.5, 1.0]]))


@pytest.mark.parametrize('format_', ['32FC1', ' 16UC1 ; png compressed'])
def test_depth_by_its_encoding_is_no_colour(format_):
    with pytest.raises(InputError, match='which is depth: use the topic of the colour camera'):
        compressed_image.decode_colour(compressed(format_, BGR))
