# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Images in files against the arrays that OpenCV wrote."""

import cv2
import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.messages.bit_depth import BitDepth
from aick_ros.sources.image_files import read_colour, read_units

PIXELS = np.random.default_rng(1).integers(0, 256, (6, 8, 3), np.uint8)
UNITS = np.random.default_rng(2).integers(0, 2 ** 16, (6, 8)).astype(np.uint16)


def test_colours_are_red_green_blue(tmp_path):
    cv2.imwrite(str(tmp_path / 'colour.png'), PIXELS[:, :, ::-1])
    np.testing.assert_array_equal(read_colour(tmp_path / 'colour.png'), PIXELS)


def test_grey_stays_grey(tmp_path):
    cv2.imwrite(str(tmp_path / 'grey.png'), PIXELS[:, :, 0])
    np.testing.assert_array_equal(read_colour(tmp_path / 'grey.png'), PIXELS[:, :, 0])


def test_grey_of_12_bits_is_as_bright_as_that_of_8(tmp_path):
    cv2.imwrite(str(tmp_path / 'grey.png'), PIXELS[:, :, 0].astype(np.uint16) << 4)
    grey = read_colour(tmp_path / 'grey.png', BitDepth())
    np.testing.assert_allclose(grey.astype(float), PIXELS[:, :, 0], atol=1)


def test_depth_is_in_the_unit_it_is_stored_in(tmp_path):
    cv2.imwrite(str(tmp_path / 'depth.png'), UNITS)
    units = read_units(tmp_path / 'depth.png')
    assert units.dtype == np.uint16
    np.testing.assert_array_equal(units, UNITS)


@pytest.mark.parametrize('read', [read_colour, read_units])
@pytest.mark.parametrize('name', ['text.png', 'missing.png'])
def test_the_file_is_named_where_it_is_missing_or_damaged(tmp_path, read, name):
    (tmp_path / 'text.png').write_text('no image')
    with pytest.raises(InputError, match=f'the image {tmp_path / name}'):
        read(tmp_path / name)


def test_colours_are_no_depth(tmp_path):
    cv2.imwrite(str(tmp_path / 'colour.png'), PIXELS)
    with pytest.raises(InputError, match=f'cannot read the image {tmp_path / "colour.png"}: '):
        read_units(tmp_path / 'colour.png')
