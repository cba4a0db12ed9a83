# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Textures in one picture: each keeps its colours, at each resolution, to its borders."""

import numpy as np
import pytest

from aick_ros.errors import InputError
from aick_ros.sources.synthetic.atlas import (
    _BORDER, _LARGEST, _LEVELS, _WIDTHS, Atlas, _in_shelves, _pack, _pyramid)
from aick_ros.sources.synthetic.surfaces import Rectangle, TexturePoints

SIZES = [(7, 5), (300, 40), (1, 1), (60, 8000), (100, 200), (299, 90), (2, 900)]


def pictures():
    rng = np.random.default_rng(0)
    return [rng.integers(0, 256, (*size, 3), np.uint8) for size in SIZES]


def test_pictures_lie_beside_each_other_with_their_borders():
    shown = pictures() * 3
    atlas, corners = _pack(shown)
    assert atlas.shape[1] == _WIDTHS[0]
    taken = np.zeros(atlas.shape[:2], int)
    for picture, (x, y) in zip(shown, corners):
        rows, columns = picture.shape[:2]
        np.testing.assert_array_equal(atlas[y:y + rows, x:x + columns], picture)
        for inner, outer in ((picture[0], atlas[y - _BORDER, x:x + columns]),
                             (picture[-1], atlas[y + rows + _BORDER - 1, x:x + columns]),
                             (picture[:, 0], atlas[y:y + rows, x - _BORDER]),
                             (picture[:, -1], atlas[y:y + rows, x + columns + _BORDER - 1])):
            np.testing.assert_array_equal(inner, outer)
        taken[y - _BORDER:y + rows + _BORDER, x - _BORDER:x + columns + _BORDER] += 1
    assert taken.max() == 1
    assert atlas.shape[0] < 3 * sum(len(picture) + 2 * _BORDER for picture in pictures()[:5])


def test_a_picture_that_is_too_wide_has_a_wider_atlas():
    long = np.random.default_rng(0).integers(0, 256, (3, _WIDTHS[0], 3), np.uint8)
    atlas, corners = _pack([long, *pictures()])
    assert atlas.shape[1] == _WIDTHS[1]
    x, y = corners[0]
    np.testing.assert_array_equal(atlas[y:y + 3, x:x + _WIDTHS[0]], long)


def test_more_pictures_than_fit_are_refused():
    """One that is wider than what cv2.remap takes."""
    with pytest.raises(InputError, match='more texture than can be rendered'):
        _pack([np.zeros((1, _LARGEST + 1, 3), np.uint8)])


def test_shelves_become_higher_the_narrower_they_are():
    sizes = np.array([(n, 10) for n in (300, 200, 100)])
    assert [_in_shelves(sizes, width)[1] for width in (600, 599, 300)] == [10, 20, 20]


@pytest.mark.parametrize('shape', [(64, 128), (100, 30), (1, 7)])
def test_each_level_is_coarser_by_the_square_root_of_two(shape):
    image = np.random.default_rng(1).integers(0, 256, (*shape, 3), np.uint8)
    levels = _pyramid(image)
    assert len(levels) == _LEVELS and levels[0] is image
    for number, level in enumerate(levels):
        assert level.shape[:2] == tuple(max(1, round(n / 2 ** (number / 2))) for n in shape)
        assert level.mean() == pytest.approx(image.mean(), rel=0.05)
    if shape == (64, 128):
        blocks = image.reshape(16, 4, 32, 4, 3).mean(axis=(1, 3))
        np.testing.assert_allclose(levels[4], blocks, atol=1.5)


def board(image, width, height):
    return Rectangle(np.eye(4), width, height, image)


def colours(atlas, number, s, t, width, stretch=(0.0, 0.0)):
    count = len(s)
    points = TexturePoints(*(np.asarray(a, np.float32) for a in (
        s, t, np.full(count, stretch[0]), np.full(count, stretch[1]))))
    return atlas.look_up(np.full(count, number), points, np.full(count, width, np.float32))


def test_a_texel_is_found_at_its_place_on_its_surface():
    surfaces = [board(image, 0.1 * image.shape[1], 0.2 * image.shape[0]) for image in pictures()]
    atlas = Atlas(surfaces)
    for number in (1, 4, 0):
        rows, columns = SIZES[number]
        v, u = (a.ravel() for a in np.mgrid[:rows, :columns])
        found = colours(atlas, number, (u + 0.5) * 0.1, (v + 0.5) * 0.2, 0.01)
        np.testing.assert_allclose(found, surfaces[number].image.reshape(-1, 3), atol=1)


def test_between_texels_it_is_linear_and_beyond_the_border_constant():
    ramp = np.repeat(np.arange(0, 200, 4, dtype=np.uint8)[None, :, None], 20, axis=0)
    atlas = Atlas([board(np.repeat(ramp, 3, axis=2), 5.0, 2.0)])
    s = np.linspace(0.05, 4.95, 200)
    found = colours(atlas, 0, s, np.full(200, 1.0), 0.01)
    np.testing.assert_allclose(found[:, 0], (s / 0.1 - 0.5) * 4, atol=1.2)
    edge = colours(atlas, 0, np.array([0.0, 5.0]), np.array([0.0, 2.0]), 0.01)
    np.testing.assert_array_equal(edge[:, 0], [0, 196])


@pytest.mark.parametrize('texels', [1, 4, 8])
def test_a_wide_pixel_sees_the_mean_of_its_texels(texels):
    """And one narrower by ten sees single ones."""
    image = np.random.default_rng(2).integers(0, 256, (256, 256, 1), np.uint8).repeat(3, 2)
    atlas = Atlas([board(image, 2.56, 2.56)])
    rng = np.random.default_rng(3)
    s, t = rng.uniform(0.4, 2.1, (2, 400))
    seen = colours(atlas, 0, s, t, 0.01 * texels)[:, 0].astype(float)

    def mean(size):
        half = size / 2
        return np.array([image[int(round(b / 0.01 - half)):int(round(b / 0.01 + half)),
                               int(round(a / 0.01 - half)):int(round(a / 0.01 + half)), 0].mean()
                         for a, b in zip(s, t)])
    if texels > 1:
        assert 0.6 < seen.std() / mean(texels).std() < 1.3
        assert np.corrcoef(seen, mean(texels))[0, 1] > 0.75
    sharp = colours(atlas, 0, s, t, 0.001)[:, 0].astype(float)
    assert sharp.std() > 0.6 * image.std()


def test_a_pixel_that_looks_aslant_is_the_mean_along_its_stretch():
    stripes = np.zeros((400, 400, 3), np.uint8)
    stripes[:, ::2] = 200  # of one centimetre each, along t
    atlas = Atlas([board(stripes, 4.0, 4.0)])
    s, t = np.random.default_rng(4).uniform(1.0, 3.0, (2, 300))
    along = colours(atlas, 0, s, t, 0.002, (0.0, 0.035))[:, 0].astype(float)
    across = colours(atlas, 0, s, t, 0.002, (0.04, 0.0))[:, 0].astype(float)
    assert along.std() > 50 > 20 > across.std()
    assert across.mean() == pytest.approx(100, abs=10)
    # the look-ups are spread over the stretch: a step is seen over its length
    step = np.zeros((400, 400, 3), np.uint8)
    step[:, 200:] = 200
    atlas = Atlas([board(step, 4.0, 4.0)])
    s = np.linspace(1.9, 2.1, 81)
    seen = colours(atlas, 0, s, np.full(81, 2.0), 0.002, (0.08, 0.0))[:, 0].astype(float)
    expected = 200 * np.clip((s - 2.0) / 0.08 + 0.5, 0, 1)
    assert np.abs(seen - expected).max() < 40
    assert np.abs(seen - expected).mean() < 8


def test_at_the_coarsest_level_taps_stay_within_the_border():
    """The longest pixel of a texture beside those of other colours sees its own alone."""
    surfaces = [board(np.full((400, 400, 3), colour, np.uint8), 4.0, 4.0) for colour in (
        10, 250, 90, 170)]
    atlas = Atlas(surfaces)
    for number, colour in enumerate((10, 250, 90, 170)):
        found = colours(atlas, number, np.full(50, 2.0), np.linspace(0, 4.0, 50), 100.0,
                        (0.0, 5000.0))
        np.testing.assert_array_equal(found, colour)
    assert atlas.look_up(np.zeros(0, int), TexturePoints(*(np.zeros(0, np.float32),) * 4),
                         np.zeros(0, np.float32)).shape == (0, 3)


def test_along_a_long_stretch_nothing_is_left_out_between_the_look_ups():
    """Of noise the mean over 0.64 m has hardly any; that of four texels has half of it."""
    image = np.random.default_rng(5).integers(0, 256, (512, 512, 1), np.uint8).repeat(3, 2)
    atlas = Atlas([board(image, 5.12, 5.12)])
    s, t = np.random.default_rng(6).uniform(1.5, 3.5, (2, 300))
    for stretch in ((0.64, 0.0), (0.0, 0.64)):
        assert colours(atlas, 0, s, t, 0.002, stretch)[:, 0].std() < 0.15 * image.std()


@pytest.mark.parametrize('axis', [0, 1])
def test_a_stretch_is_in_metres_of_its_own_axis(axis):
    """Of a picture that is stretched itself, twice as much along t as along s."""
    step = np.zeros((400, 400, 3), np.uint8)
    half = [slice(None), slice(None)]
    half[1 - axis] = slice(200, None)
    step[tuple(half)] = 200
    atlas = Atlas([board(step, 4.0, 8.0)])
    middle = np.array([2.0, 4.0])
    along = middle[axis] + np.linspace(-0.3, 0.3, 61)
    places = [np.full(61, middle[0]), np.full(61, middle[1])]
    places[axis] = along
    stretch = [0.0, 0.0]
    stretch[axis] = 0.2
    seen = colours(atlas, 0, *places, 0.002, stretch)[:, 0].astype(float)
    expected = 200 * np.clip((along - middle[axis]) / 0.2 + 0.5, 0, 1)
    assert np.abs(seen - expected).mean() < 10
