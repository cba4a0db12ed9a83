# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Pictures and writing: what is in them, where it is, and that nothing leaves its box."""

import cv2
import numpy as np
import pytest

from aick_ros.sources.synthetic import drawings
from aick_ros.sources.synthetic.drawings import (
    INK, chart, diagram, ink_on, landscape, lines, ornament, shapes, title, write)

SHAPE = 240, 360
SKY, LAND = (120.0, 160.0, 210.0), (90.0, 130.0, 60.0)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def is_colour(image, colour, within=2):
    return (np.abs(image.astype(int) - np.asarray(colour)) <= within).all(axis=2)


def test_a_landscape_has_its_sky_above_its_land(rng):
    for _ in range(5):
        image = landscape(rng, *SHAPE, sky=SKY, land=LAND).astype(float)
        assert image.shape == (*SHAPE, 3)
        top = np.median(image[:10], axis=(0, 1))
        np.testing.assert_allclose(top, SKY, atol=25)
        ground = np.median(image[-10:], axis=(0, 1))
        # the nearest of four hills, each a fifth darker than the one behind
        np.testing.assert_allclose(ground, 0.4 * np.array(LAND), rtol=0.25)
        hills = image[:, :, 1] - image[:, :, 2] > 5
        assert hills[:60].mean() < 0.05 and hills[-20:].mean() > 0.9
        assert is_colour(image, (255, 244, 210))[:150].sum() > 300  # the sun
    free = landscape(rng, *SHAPE)
    assert np.ptp(free, axis=(0, 1)).min() > 40


def test_an_abstract_painting_has_many_colours(rng):
    image = shapes(rng, *SHAPE)
    assert image.shape == (*SHAPE, 3)
    colours, counts = np.unique(image.reshape(-1, 3), axis=0, return_counts=True)
    assert 12 <= np.count_nonzero(counts > 100) <= 60
    ground = colours[counts.argmax()]
    assert ground.max() > 0.75 * 255 and 0.1 < counts.max() / counts.sum() < 0.9


def test_a_map_has_land_sea_shores_and_towns(rng):
    image = chart(rng, *SHAPE)
    sea, land = is_colour(image, (122, 166, 196)), is_colour(image, (196, 206, 150))
    snow = is_colour(image, (236, 232, 226))
    around = cv2.dilate(snow.astype(np.uint8), np.ones((5, 5))) > 0
    assert snow.mean() > 0.01 and not (around & sea).any()  # the highest are not at the sea
    assert sea.mean() > 0.15 and land.mean() > 0.08
    towns = is_colour(image, (150, 30, 30), 20).sum()
    assert 14 * 10 < towns < 14 * 40
    # between sea and land there is a line
    shore = is_colour(image, (84, 92, 84), 0)
    coast = cv2.dilate(sea.astype(np.uint8), np.ones((3, 3))) * cv2.dilate(
        land.astype(np.uint8), np.ones((3, 3)))
    assert shore.sum() > 1000
    assert cv2.dilate(coast, np.ones((5, 5)))[shore].mean() > 0.15


def test_a_diagram_has_eight_bars_on_one_foot(rng):
    image = diagram(rng, *SHAPE)
    for border in (image[0], image[-1], image[:, 0]):
        np.testing.assert_array_equal(border, np.broadcast_to(INK, border.shape))
    bars = ~is_colour(image[1:-1, 1:-1], (250, 250, 250))
    foot = bars[-3].astype(int)
    assert np.count_nonzero(np.diff(foot, prepend=0) == 1) == 8
    heights = [bars[:, column].sum() for column in np.flatnonzero(foot)]
    assert 0.1 * 240 - 4 < min(heights) < 0.5 * 240 < max(heights) < 0.9 * 240 + 4
    assert not bars[0].any() and not bars[-1].any()


@pytest.mark.parametrize('pitch', [7, 12])
def test_lines_of_words_have_their_pitch_and_inks(rng, pitch):
    page = np.full((*SHAPE, 3), 240, np.uint8)
    inks = [(10, 20, 30), (200, 30, 40)]
    lines(rng, page, pitch, inks)
    written = (page != 240).any(axis=2)
    assert all(is_colour(page, ink, 0).sum() > 500 for ink in inks)
    assert (is_colour(page, inks[0], 0) | is_colour(page, inks[1], 0))[written].all()
    feet = np.arange(2, SHAPE[0] - 4, pitch) + 3
    expected = np.zeros(SHAPE[0], bool)
    expected[feet] = True
    full = written.mean(axis=1) > 0.2
    assert (full[feet].mean() > 0.9) and not written[~np.isin(
        np.arange(SHAPE[0]), np.concatenate([feet - step for step in range(4)]))].any()
    ends = [np.flatnonzero(row).max() for row in written[feet]]
    assert 0.45 * 360 < min(ends) < 0.65 * 360 and max(ends) > 0.85 * 360
    assert 0.3 < written[feet].mean() / 0.75 < 0.7  # letters two wide, gaps between them


def test_an_ornament_has_two_of_the_colours_and_stays_near(rng):
    colours = [(200.0, 10.0, 10.0), (10.0, 200.0, 10.0), (10.0, 10.0, 200.0)]
    kinds = set()
    for _ in range(30):
        image = np.zeros((60, 60, 3), np.uint8)
        ornament(rng, image, (30, 25), colours)
        assert sum(is_colour(image, colour, 0).any() for colour in colours) == 2
        row, column = np.nonzero(image.any(axis=2))
        np.testing.assert_allclose([np.mean([row.min(), row.max()]),
                                    np.mean([column.min(), column.max()])], [25, 30], atol=0.5)
        size = np.ptp(row) // 2
        assert 4 <= size <= 15
        kinds.add(bool(image[25 - int(0.65 * size), 30 - int(0.65 * size)].any()))
        assert image[25, 30].tolist() in [list(map(int, colour)) for colour in colours]
    assert kinds == {False, True}  # rhombs and discs


@pytest.mark.parametrize('count', [1, 2, 5])
def test_titles_have_their_number_of_words(rng, count):
    drawn = [title(rng, count).split(' ') for _ in range(200)]
    assert {len(words) for words in drawn} == {count}
    assert {word for words in drawn for word in words} == set(drawings._WORDS)


@pytest.mark.parametrize('grey', [0, 60, 119, 122, 200, 255])
def test_ink_can_be_read(grey):
    assert abs(np.mean(ink_on(np.full(3, grey))) - grey) > 60


@pytest.mark.parametrize('box', [(30, 40, 330, 80), (30, 40, 130, 200), (0, 0, 360, 240)])
def test_writing_fills_its_box_and_stays_in_it(box):
    image = np.full((*SHAPE, 3), 255, np.uint8)
    write(image, 'NORTH', box, (0, 0, 0))
    row, column = np.nonzero((image < 128).any(axis=2))
    left, top, right, bottom = box
    assert left - 2 <= column.min() and column.max() <= right + 2
    assert top - 3 <= row.min() and row.max() <= bottom + 3
    # as large as it fits: full in one of the directions, in the middle of the height
    filled = np.ptp(column) / (right - left), np.ptp(row) / (bottom - top)
    assert max(filled) > 0.7
    assert abs((row.min() + row.max()) / 2 - (top + bottom) / 2) < 0.1 * (bottom - top) + 2


def test_writing_too_small_to_be_seen_is_omitted():
    image = np.full((*SHAPE, 3), 255, np.uint8)
    write(image, 'NORTH', (10, 10, 20, 12), INK)
    assert (image == 255).all()
