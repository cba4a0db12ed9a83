# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""RVL data: against the encoder of the package rvl, and digits set by hand."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from aick_ros.errors import InputError
from aick_ros.messages.rvl import decode_rvl

RNG = np.random.default_rng(6)


def encoded(image):
    """Return the RVL data of an image; the package puts the number of pixels before it."""
    return pytest.importorskip('rvl').compress(image.astype('<u2').tobytes())[4:]


def wall_with_holes():
    """Return a depth image as sensors have it: a slope with noise, shadows and speckle."""
    rows, columns = np.mgrid[:48, :64]
    depth = 1500 + 10 * columns + 3 * rows + RNG.integers(-3, 4, rows.shape)
    depth[10:30, 20:25] = 0
    depth[RNG.random(rows.shape) < 0.05] = 0
    return depth


IMAGES = {
    'a wall with holes': wall_with_holes(),
    'every number': RNG.integers(0, 65536, (48, 64)),
    'every second pixel': RNG.integers(0, 65536, (48, 64)) * (np.indices((48, 64)).sum(0) % 2),
    'nothing': np.zeros((480, 640)),
    'nothing at either end': np.pad(RNG.integers(1, 9000, (6, 64)), ((3, 4), (0, 0))),
    'extremes in turn': np.tile([1, 65535], (48, 32)),
    'one pixel': np.array([[7]]),
    'one row': RNG.integers(0, 3, (1, 1000)),
}


@pytest.mark.parametrize('image', IMAGES.values(), ids=IMAGES.keys())
def test_what_was_encoded_comes_back(image):
    decoded = decode_rvl(encoded(image), image.shape[1], image.shape[0])
    assert decoded.dtype == np.uint16
    assert np.array_equal(decoded, image)


def test_digits_set_by_hand():
    """2 zeros, 1 other: 5 more than 0 is 10, in octal 12, lowest digit first; then filled up."""
    assert decode_rvl(struct.pack('<I', 0x2_1_A1_0000), 3, 1).tolist() == [[0, 0, 5]]
    # 0 zeros, 2 others: +3 is 6, -3 is 5; 1 zero, 0 others
    assert decode_rvl(struct.pack('<I', 0x0_2_65_1_0_00), 3, 1).tolist() == [[3, 0, 0]]


def test_a_number_may_have_nine_digits():
    """So it is below 2^31; the difference is 2 with zeros before it, +1."""
    assert decode_rvl(struct.pack('<2I', 0x0_1_A88888, 0x880_00000), 1, 1).tolist() == [[1]]
    with pytest.raises(InputError, match='RVL data is damaged'):
        decode_rvl(struct.pack('<2I', 0x0_1_A88888, 0x8880_0000), 1, 1)


def test_data_behind_the_last_pixel_is_ignored():
    image = IMAGES['a wall with holes']
    assert np.array_equal(decode_rvl(encoded(image) + bytes(9), 64, 48), image)


@pytest.mark.parametrize('name', ['a wall with holes', 'every number', 'every second pixel'])
def test_truncated_data_is_rejected(name):
    data = encoded(IMAGES[name])
    for size in (*range(40), *range(40, len(data) - 4, 61), len(data) - 4):
        with pytest.raises(InputError, match=(
                '^its RVL data is truncated: record it again, or have the '
                r'publisher send PNG \(its parameter compressedDepth.'
                r'format\)$')):
            decode_rvl(data[:size], 64, 48)


def test_where_one_number_is_missing_the_data_is_truncated():
    """0 zeros, 7 others: all but the last difference fill a word."""
    words = struct.pack('<2I', 0x0_7_222222, 0x2_0000000)
    assert decode_rvl(words, 7, 1).tolist() == [[1, 2, 3, 4, 5, 6, 7]]
    with pytest.raises(InputError, match='RVL data is truncated'):
        decode_rvl(words[:4], 7, 1)


def test_more_pixels_than_there_should_be_are_rejected():
    with pytest.raises(InputError, match='RVL data is damaged'):
        decode_rvl(encoded(IMAGES['nothing']), 640, 479)


@pytest.mark.parametrize('width, height', [
    (0, 480), (640, 0), (-640, -480), (2 ** 31 - 1, 2 ** 31 - 1), (4096, 1025)])
def test_impossible_sizes_are_rejected(width, height):
    with pytest.raises(InputError, match=(
            f'^its RVL data is declared as {width} x {height} pixels, '
            'so it is damaged: record it again$')):
        decode_rvl(encoded(IMAGES['nothing']), width, height)


def test_a_number_that_never_ends_is_rejected():
    with pytest.raises(InputError, match='RVL data is damaged'):
        decode_rvl(b'\xff' * 40 + bytes(40), 64, 48)


@pytest.mark.parametrize('width, height, size', [(64, 48, 10_000), (1, 1, 10 ** 6)])
def test_more_data_than_the_pixels_can_have_is_rejected(width, height, size):
    with pytest.raises(InputError, match=(
            f'^its {size} bytes of RVL data are more than {width} x '
            '.* pixels can have, so it is damaged: record it again$')):
        decode_rvl(bytes(size), width, height)


@given(st.binary(max_size=300), st.integers(-3, 40), st.integers(-3, 40))
def test_any_bytes_are_an_image_or_an_input_error(data, width, height):
    try:
        image = decode_rvl(data, width, height)
    except InputError:
        return
    assert image.shape == (height, width)


@given(arrays(np.uint16, st.tuples(st.integers(1, 12), st.integers(1, 12)),
              elements=st.just(0) | st.integers(0, 65535)))
def test_any_image_comes_back(image):
    assert np.array_equal(decode_rvl(encoded(image), *image.shape[::-1]), image)


def test_runs_without_pixels_come_to_an_end():
    with pytest.raises(InputError, match='RVL data is damaged'):
        decode_rvl(bytes(9_000), 64, 48)


def test_noise_is_decoded_or_rejected():
    data = np.frombuffer(encoded(IMAGES['a wall with holes']), np.uint8)
    rejected = 0
    for _ in range(300):
        damaged = data.copy()
        damaged[RNG.integers(0, len(data), 5)] ^= RNG.integers(1, 256, 5, np.uint8)
        try:
            assert decode_rvl(damaged.tobytes(), 64, 48).shape == (48, 64)
        except InputError:
            rejected += 1
    assert rejected > 150


@pytest.mark.parametrize('beyond', [0, 1])
def test_a_pixel_takes_three_bytes_at_most_and_the_rest_64(beyond):
    size = 3 * 6 * 4 + 64 + beyond
    with pytest.raises(InputError) as raised:
        decode_rvl(bytes(size), 6, 4)  # runs of nothing, so damaged anyway
    assert (f'its {size} bytes of RVL data are more than 6 x 4 pixels can have' in
            str(raised.value)) == beyond


@pytest.mark.parametrize('width, height, is_possible', [
    (2048, 2048, True), (2 ** 22, 1, True), (2 ** 22 + 1, 1, False), (1, 2 ** 22 + 1, False)])
def test_the_most_pixels_are_possible(width, height, is_possible):
    with pytest.raises(InputError) as raised:
        decode_rvl(b'', width, height)
    assert ('so it is damaged' in str(raised.value)) is not is_possible
    assert ('RVL data is truncated' in str(raised.value)) is is_possible
