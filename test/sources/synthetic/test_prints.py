# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Printed things at the sizes they have in a room: what makes each of them one."""

import numpy as np
import pytest

from aick_ros.sources.synthetic import prints
from aick_ros.sources.synthetic.drawings import INK

WOOD = (150.0, 106.0, 66.0)
EVERY = {
    'spines': (prints.spines, 0.9, 0.3, 0.0015), 'cover': (prints.cover, 0.21, 0.28, 0.0015),
    'poster': (prints.poster, 0.5, 0.7, 0.002), 'page': (prints.page, 0.21, 0.297, 0.0015),
    'screen': (prints.screen, 0.55, 0.34, 0.0015),
    'keyboard': (prints.keyboard, 0.44, 0.15, 0.0015), 'rug': (prints.rug, 2.0, 1.4, 0.003),
    'view': (prints.view, 1.4, 1.2, 0.003), 'globe': (prints.globe, 0.75, 0.24, 0.0015),
    'clock': (prints.clock, 0.3, 0.3, 0.0015), 'carton': (prints.carton, 0.52, 0.36, 0.002),
    'drawers': (prints.drawers(WOOD, 2, 3), 1.3, 0.85, 0.0025),
    'door': (prints.door(WOOD), 0.85, 2.0, 0.0025)}


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture
def drawn(rng):
    """Return a function that draws a print at its size, as float."""
    def draw(name, size=None):
        make, width, height, _ = EVERY[name]
        return make(rng, *(size or (width, height))).astype(float)
    return draw


def near(image, colour, within=3):
    return (np.abs(image - np.asarray(colour)) <= within).all(axis=2)


@pytest.mark.parametrize('name', EVERY)
def test_it_has_the_size_and_is_drawn_anew(drawn, name):
    _, width, height, texel = EVERY[name]
    one, other = drawn(name), drawn(name)
    expected = np.array([height, width]) / texel
    assert np.abs(np.subtract(one.shape[:2], expected)).max() <= 1
    assert np.abs(one - other).mean() > 1.0
    # whatever it is, it has something to see in each half
    rows, columns = one.shape[0] // 2, one.shape[1] // 2
    assert min(part.std() for part in (one[:rows], one[rows:], one[:, :columns],
                                       one[:, columns:])) > 5


def test_books_stand_side_by_side(drawn):
    image = drawn('spines', (2.0, 0.3))
    rows, columns = image.shape[:2]
    behind = near(image, (30, 24, 20), 0)
    # none is wider than 5 cm, each stands on the board, the first one up to its top
    assert not behind[-1].any() and not behind[0, :10].any()
    tops = np.where(behind.any(axis=0), (~behind).argmax(axis=0), 0)
    assert tops.max() <= 0.12 * rows and np.mean(tops > 0) > 0.7
    edges = np.flatnonzero(np.diff(tops)) + 1
    widths = np.diff([0, *edges, columns]) * 0.0015
    assert 0.016 < widths.min() and np.median(widths) < 0.055
    # a back is darker at its sides than in its middle
    profile = image[int(0.6 * rows)].mean(axis=1)
    shares = [profile[a] / max(profile[a + (b - a) // 2], 1) for a, b in zip(edges, edges[1:])]
    assert np.median(shares) < 0.95


def test_a_cover_has_a_picture_between_two_titles(drawn):
    for _ in range(5):
        image = drawn('cover')
        rows, columns = image.shape[:2]
        ground = near(image, image[0, 0], 0)
        margin = columns // 12
        for strip in (ground[:, :margin], ground[:, -margin:], ground[:margin - 1]):
            assert strip.mean() > 0.95
        assert ground[int(0.32 * rows):int(0.8 * rows), margin:-margin].mean() < 0.1
        above, below = ground[margin:int(0.32 * rows)], ground[int(0.82 * rows):]
        assert 0.5 < above.mean() < 0.99 > below.mean() > 0.5


def test_a_poster_has_a_frame_and_a_title_below_its_picture(drawn):
    for _ in range(6):
        image = drawn('poster')
        rows, columns = image.shape[:2]
        edge = round(min(rows, columns) / 22)
        frame = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
        assert np.ptp(frame, axis=0).max() == 0 and frame[0].max() < 0.45 * 255
        paper = near(image, (236, 230, 218), 0)
        assert paper[edge:2 * edge - 1, edge:-edge].mean() > 0.95
        assert paper[-3 * edge:-edge, 2 * edge:-2 * edge].mean() > 0.6
        assert near(image, INK, 40)[-3 * edge:-edge, 2 * edge:-2 * edge].any()
        assert paper[2 * edge:-3 * edge, 2 * edge:-2 * edge].mean() < 0.3


def test_a_page_has_lines_under_a_headline_and_a_diagram_or_none(drawn):
    kinds = set()
    for _ in range(12):
        image = drawn('page')
        rows, columns = image.shape[:2]
        margin = columns // 10
        paper = near(image, (240, 238, 230), 0)
        for strip in (paper[:margin - 2], paper[-margin + 2:], paper[:, :margin - 2],
                      paper[:, -margin + 3:]):
            assert strip.all()
        assert 0.02 < np.mean(~paper[margin:margin + rows // 11]) < 0.6
        assert 0.03 < np.mean(~paper[-2 * margin:-margin]) < 0.4
        kinds.add(bool(near(image, (250, 250, 250), 0).any()))
    assert kinds == {True, False}


def test_a_screen_has_a_black_frame_and_two_windows(drawn):
    image = drawn('screen')
    rows, columns = image.shape[:2]
    frame = near(image, (18, 18, 18), 0)
    assert frame[:6].all() and frame[-6:].all() and frame[:, :6].all() and frame[:, -6:].all()
    assert not frame[8:-8, 8:-8].any()
    bars = near(image, (80, 110, 160), 0)
    for x, y in ((0.04, 0.08), (0.48, 0.2)):
        assert bars[int(y * rows), int((x + 0.02) * columns):int((x + 0.4) * columns)].all()
    dark, light = near(image, (34, 36, 44), 0), near(image, (228, 228, 224), 0)
    assert dark[int(0.5 * rows), :int(0.48 * columns)].mean() > 0.3
    assert light[int(0.5 * rows), int(0.48 * columns):].mean() > 0.3
    assert not dark[:, int(0.55 * columns):].any() and not light[:, :int(0.47 * columns)].any()


def test_a_keyboard_has_six_rows_of_keys_with_letters(drawn):
    image = drawn('keyboard')
    keys = near(image, (205, 205, 200), 0)
    pitch = image.shape[0] / 6
    down = np.diff((keys.mean(axis=1) > 0.3).astype(int), prepend=0, append=0)
    np.testing.assert_allclose(np.flatnonzero(down == 1), np.arange(6) * pitch + 2, atol=1)
    np.testing.assert_allclose(np.flatnonzero(down == -1), (np.arange(6) + 1) * pitch, atol=1)
    row = keys[int(0.5 * pitch) - 6]
    starts = np.flatnonzero(np.diff(row.astype(int), prepend=0) == 1)
    assert len(starts) >= image.shape[1] // pitch - 1
    assert near(image, INK, 60).sum() > 6 * 10 * 8  # letters
    assert keys[:, -int(pitch) - 6:].any()


def test_a_rug_is_the_same_on_all_four_quarters_and_has_borders(drawn):
    image = drawn('rug')
    rows, columns = image.shape[:2]
    mirrored = np.mean([image, image[::-1], image[:, ::-1], image[::-1, ::-1]], axis=0)
    # but for the shade of its pile, up to 13 and 8 % of clouds
    worn = np.abs(image - mirrored).mean() / image.mean()
    assert 0.01 < worn < 0.12
    grey = image.mean(axis=2) / image.mean()
    assert np.corrcoef(grey.ravel(), grey[::-1].ravel())[0, 1] > 0.8
    assert np.corrcoef(grey.ravel(), grey[:, ::-1].ravel())[0, 1] > 0.8
    hues = image / image.sum(axis=2, keepdims=True)
    along_edge = hues[2:5, 60:-60].reshape(-1, 3)
    assert along_edge.std(axis=0).max() < 0.02
    light = hues[38, 60:-60]
    assert np.abs(np.median(light, axis=0) - np.median(along_edge, axis=0)).max() > 0.02
    for line in (hues[38, 60:-60], hues[60:-60, 38], hues[43, 60:-60], hues[60:-60, 43]):
        assert line.std(axis=0).max() < 0.02  # plain stripes beside the ornaments
    assert hues[23, 60:-60].std(axis=0).max() > 0.04
    assert hues[100:-100, 100:-100].std(axis=(0, 1)).max() > 0.03


def test_a_window_has_bars_and_the_outside_is_bright(drawn):
    image = drawn('view')
    rows, columns = image.shape[:2]
    bars = near(image, (228, 226, 220), 0)
    across = np.flatnonzero(bars.all(axis=1))
    down = np.flatnonzero(bars.all(axis=0))
    wide = 17
    for lines, middles in ((across, (8, rows // 3, rows - 8)),
                           (down, (8, columns // 2, columns - 8))):
        for middle in middles:
            assert np.isin(np.arange(middle - 7, middle + 7).clip(0), lines).all()
        assert len(lines) < 3 * (wide + 3)
    assert image.min() >= 60
    sky, land = image[rows // 6, 30:columns // 2 - 20], image[-40, 30:columns // 2 - 20]
    assert sky.mean() > land.mean() + 20


def test_a_globe_has_a_grid_of_meridians_and_parallels(drawn):
    image = drawn('globe')
    grid = near(image, (90, 90, 80), 0)
    for axis in (0, 1):
        lines = np.flatnonzero(grid.mean(axis=axis) > 0.9)
        expected = (np.arange(1, 12) / 12 * image.shape[1 - axis]).astype(int)
        np.testing.assert_array_equal(lines, expected)
    assert near(image, (122, 166, 196)).mean() > 0.1  # sea


def test_a_clock_has_twelve_hours_and_two_hands(drawn):
    """The hours at 0.74 of the radius, each at its angle; 12 above, 6 below."""
    image = np.mean([drawn('clock') for _ in range(20)], axis=0).mean(axis=2)
    dark = np.mean((238, 236, 228)) - image
    centre, radius = 100, 100
    v, u = np.mgrid[:200, :200] - centre
    far = np.hypot(u, v) / radius
    assert dark[np.abs(far - 1) < 0.03].mean() > 150
    ring = (far > 0.67) & (far < 0.9)  # beyond the hands
    weights = np.where(ring, dark, 0)
    angles = np.degrees(np.arctan2(u, -v)) % 360
    sums = np.array([weights[np.abs((angles - 30 * hour + 180) % 360 - 180) < 7].sum()
                     for hour in np.arange(0, 12, 0.5)])
    # between two hours there is less than at either, in any font of OpenCV
    hours, between = sums[0::2], sums[1::2]
    assert (hours > between).all() and (hours > np.roll(between, 1)).all()
    single = drawn('clock').mean(axis=2) < 100
    assert single[(far < 0.4) & (far > 0.3)].sum() >= 2 * 5


def test_a_carton_has_a_tape_and_a_white_label(drawn):
    for _ in range(5):
        image = drawn('carton')
        rows, columns = image.shape[:2]
        white = near(image, (240, 238, 230), 6)
        tape = near(image, (196, 168, 120), 0)
        middle = tape[:, columns // 2 - 10:columns // 2 + 10]
        assert (middle | white[:, columns // 2 - 10:columns // 2 + 10]).mean() > 0.7
        assert not tape[:, :columns // 2 - 11].any() and not tape[:, columns // 2 + 11:].any()
        label = np.nonzero(white)
        assert 0.35 * rows < np.ptp(label[0]) < 0.41 * rows
        assert 0.35 * columns < np.ptp(label[1]) < 0.41 * columns
        stamp = near(image, (60, 40, 30), 30)
        assert stamp[int(0.83 * rows):, columns // 12 - 2:columns // 2 - 10].any()
        assert not stamp[:int(0.08 * rows)].any()
        bare = image[:int(0.09 * rows), :columns // 3]
        np.testing.assert_allclose(np.median(bare, axis=(0, 1)), (176, 136, 92), rtol=0.12)


@pytest.mark.parametrize('columns, rows', [(2, 3), (1, 4)])
def test_each_drawer_has_its_knob_in_the_middle(rng, columns, rows):
    image = prints.drawers(WOOD, columns, rows)(rng, 1.3, 0.85).astype(float)
    tall, wide = np.array(image.shape[:2]) / (rows, columns)
    brass = near(image, (214, 190, 130), 4)
    assert brass.sum() == pytest.approx(rows * columns * np.pi * 4 ** 2, rel=0.35)
    gap = near(image, [0.35 * c for c in WOOD], 1)
    for row in range(rows):
        for column in range(columns):
            v, u = round((row + 0.5) * tall), round((column + 0.5) * wide)
            assert brass[v - 5:v + 6, u - 6:u + 5].sum() > 30
            assert gap[round(row * tall) + 4:round(row * tall) + 9, u].any()
            assert gap[v, round(column * wide) + 4:round(column * wide) + 9].any()


def test_a_door_has_four_panels_and_a_handle_at_the_right(drawn):
    image = drawn('door')
    rows, columns = image.shape[:2]
    dark = near(image, [0.55 * c for c in WOOD], 1)
    light = near(image, [min(255, 1.25 * c) for c in WOOD], 1)
    assert dark[:3].all() and dark[-3:].all() and dark[:, :3].all() and dark[:, -3:].all()
    for x in (0.12, 0.46, 0.54, 0.88):
        for low, high in ((0.08, 0.4), (0.54, 0.92)):
            assert dark[int(low * rows):int(high * rows), int(x * columns)].mean() > 0.95
    for y in (0.06, 0.42, 0.52, 0.94):
        assert dark[int(y * rows), int(0.14 * columns):int(0.44 * columns)].mean() > 0.95
    for x, side in ((0.12, 8), (0.46, -8), (0.54, 8), (0.88, -8)):
        assert light[int(0.1 * rows):int(0.4 * rows), int(x * columns) + side].mean() > 0.9
    handle = near(image, (190, 180, 150), 0)
    assert handle[rows // 2, int(0.9 * columns):int(0.97 * columns)].all()
    assert not handle[:, :int(0.88 * columns)].any()
    assert np.ptp(np.nonzero(handle)[0]) < 12
