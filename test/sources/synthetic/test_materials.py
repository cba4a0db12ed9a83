# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Materials at any size: their colour, and the structure that each is named after."""

import colorsys

import numpy as np
import pytest

from aick_ros.sources.synthetic import materials
from aick_ros.sources.synthetic.materials import blank, cloud, hue, scaled, shade, tint

COLOUR = (150.0, 106.0, 66.0)
EVERY = {
    'plain': (materials.plain(COLOUR), 0.004), 'wood': (materials.wood(COLOUR), 0.0025),
    'planks': (materials.planks(COLOUR), 0.0035), 'plaster': (materials.plaster(COLOUR), 0.005),
    'wallpaper': (materials.wallpaper(COLOUR, ((110, 130, 100), (90, 90, 160))), 0.0035),
    'brick': (materials.brick(COLOUR), 0.0035), 'fabric': (materials.fabric(COLOUR), 0.0025),
    'curtain': (materials.curtain(COLOUR, (226, 214, 190)), 0.0025),
    'leaves': (materials.leaves(), 0.002), 'glaze': (materials.glaze(COLOUR, (60, 84, 130)),
                                                     0.0015)}


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def brightness(image):
    """Return the brightness of each texel by the mean, HxW."""
    mean = image.astype(float).mean(axis=2)
    return mean / mean.mean()


@pytest.mark.parametrize('name', EVERY)
@pytest.mark.parametrize('width, height', [(1.3, 0.6), (0.4, 1.1), (0.06, 0.03), (1e-4, 1e-4)])
def test_a_material_fills_a_surface_of_any_size(rng, name, width, height):
    make, texel = EVERY[name]
    image = make(rng, width, height)
    assert image.shape == (max(2, round(height / texel)), max(2, round(width / texel)), 3)
    assert image.dtype == np.uint8


@pytest.mark.parametrize('name, share', [
    ('plain', 0.02), ('wood', 0.08), ('plaster', 0.04), ('fabric', 0.05), ('wallpaper', 0.15)])
def test_a_material_is_of_its_colour(rng, name, share):
    image = EVERY[name][0](rng, 1.5, 1.5)
    np.testing.assert_allclose(np.median(image, axis=(0, 1)), COLOUR, rtol=share)


@pytest.mark.parametrize('name', EVERY)
def test_another_draw_is_another_picture(rng, name):
    one, other = (EVERY[name][0](rng, 0.3, 0.3) for _ in range(2))
    assert np.abs(one.astype(float) - other).mean() > 0.5


@pytest.mark.parametrize('octaves', [1, 3])
def test_a_cloud_is_smooth_noise_of_its_cell(rng, octaves):
    noise = np.stack([cloud(rng, (240, 400), (24, 40), octaves) for _ in range(6)])
    assert (noise.dtype, noise.shape) == (np.float32, (6, 240, 400))
    assert np.abs(noise.mean()) < 0.1
    # of draws from -1 to 1, cubically interpolated, the octaves weighted by 1, 0.6, 0.36
    weights = 0.6 ** np.arange(octaves)
    assert 0.25 < noise.std() / np.sqrt((weights ** 2).sum()) < 0.55
    assert 0.8 < np.abs(noise).max() / weights.sum() < 1.6
    # half a cell on it is alike, two cells on it is not; of one octave alone to the full extent
    for axis, cell in ((1, 24), (2, 40)):
        def likeness(step):
            moved = np.roll(noise, -step, axis)
            inner = (slice(None), slice(0, 180), slice(0, 300))
            return np.corrcoef(noise[inner].ravel(), moved[inner].ravel())[0, 1]
        assert likeness(2 * cell) < 0.25
        assert likeness(cell // 8) > 0.9
        if octaves == 1:
            assert 0.4 < likeness(cell // 2) < 0.9


def test_tints_and_shades_are_products():
    tone = np.array([[0.0, 0.5, 1.0, 3.0]], np.float32)
    np.testing.assert_array_equal(tint((100.0, 50.0, 20.0), tone), [[
        [0, 0, 0], [50, 25, 10], [100, 50, 20], [255, 150, 60]]])
    image = np.array([[[100, 50, 20]] * 4], np.uint8)
    np.testing.assert_array_equal(shade(image, tone), tint((100.0, 50.0, 20.0), tone))
    assert scaled((10.0, 20.0, 30.0), 0.5) == (5.0, 10.0, 15.0)
    np.testing.assert_array_equal(blank(0.5, 0.3, 0.1, (1, 2, 3)), np.full((3, 5, 3), (1, 2, 3)))


def test_hues_are_any_and_keep_their_saturation_and_value(rng):
    drawn = np.array([colorsys.rgb_to_hsv(*(c / 255 for c in hue(rng, (0.3, 0.4), (0.6, 0.9))))
                      for _ in range(300)])
    for column, (low, high) in enumerate(((0.0, 1.0), (0.3, 0.4), (0.6, 0.9))):
        margin = 0.1 * (high - low)
        assert low - 1e-6 <= drawn[:, column].min() < low + margin
        assert high - margin < drawn[:, column].max() <= high + 1e-6


def roughness(image):
    """Return how much the brightness changes from texel to texel, down and to the right."""
    tone = brightness(image)
    return [np.abs(np.diff(tone, axis=axis)).mean() for axis in (0, 1)]


@pytest.mark.parametrize('width, height', [(1.2, 0.5), (0.5, 1.2)])
def test_the_grain_of_wood_runs_along_the_longer_side(rng, width, height):
    down, right = roughness(materials.wood(COLOUR)(rng, width, height))
    across, along = (down, right) if width > height else (right, down)
    assert across > 2.0 * along


def test_a_floor_has_planks_of_twelve_centimetres(rng):
    tone = brightness(materials.planks(COLOUR)(rng, 3.0, 2.0))
    rows = tone.mean(axis=1)
    joints = np.flatnonzero(rows < 0.65)
    np.testing.assert_array_equal(joints, np.arange(0, len(rows), round(0.12 / 0.0035)))
    for top in joints[1:-1]:  # planks end within each row, not all at the same place
        plank = tone[top + 2:top + 32]
        assert 2 <= np.count_nonzero(plank.mean(axis=0) < 0.62) <= 9
    ends = [np.flatnonzero(tone[top + 2:top + 32].mean(axis=0) < 0.62)[1] for top in joints[1:-1]]
    assert len(set(ends)) > 5


def test_a_brick_wall_has_courses_and_joints_that_alternate(rng):
    image = materials.brick((164, 92, 70))(rng, 4.0, 1.5)
    # mortar is grey, bricks are red
    red = image[..., 0].astype(float) - image[..., 2] > 30
    assert 0.7 < red.mean() < 0.9
    rows = red.mean(axis=1)
    spectrum = np.abs(np.fft.rfft(rows - rows.mean()))
    assert 1.5 / np.argmax(spectrum) == pytest.approx(0.075, rel=0.1)
    courses = [red[int((k + 0.5) * 0.075 / 0.0035)] for k in range(1, 19)]
    joints = np.array([np.abs(np.fft.fft(~course)) for course in courses])
    assert 4.0 / (1 + joints[:, 1:60].mean(axis=0).argmax()) == pytest.approx(0.22, rel=0.1)
    # the phase of every other course is opposite
    wave = np.exp(-2j * np.pi * np.arange(red.shape[1]) * 0.0035 / 0.22)
    phases = np.array([(~course) @ wave for course in courses])
    turns = np.abs(np.angle(phases[1:] / phases[:-1]))
    assert np.median(turns) > 2.4


def test_stripes_of_cloth_are_vertical_and_of_the_second_colour(rng):
    image = materials.fabric((40.0, 40.0, 40.0), (220.0, 220.0, 220.0))(rng, 0.8, 0.5)
    columns = image.mean(axis=(0, 2))
    striped = columns > 130
    assert np.ptp(image.mean(axis=2)[:, striped].mean(axis=1)) < 60
    edges = np.flatnonzero(np.diff(striped.astype(int)))
    wide, gap = np.diff(edges)[0::2], np.diff(edges)[1::2]
    if striped[edges[0] + 1] == 0:
        wide, gap = gap, wide
    assert len(set(wide)) == len(set(gap)) == 1
    assert gap[0] == 2 * wide[0]
    assert 8 <= wide[0] < 22


def test_a_curtain_has_folds_from_top_to_bottom(rng):
    cloth = materials.curtain(COLOUR, COLOUR)(rng, 1.7, 0.6)
    tone = brightness(cloth).mean(axis=0)
    down = np.ptp(brightness(cloth).mean(axis=1))
    assert 0.35 < np.ptp(tone) < 0.8 and down < 0.2
    spectrum = np.abs(np.fft.rfft(tone - tone.mean()))
    assert len(tone) / spectrum.argmax() == pytest.approx(34, rel=0.25)


def test_glaze_has_bands_around_and_leaves_are_dense(rng):
    image = materials.glaze((214, 204, 190), (60, 84, 130))(rng, 0.8, 0.3)
    blue = image[..., 2].astype(int) > image[..., 0].astype(int) + 20
    around = blue.mean(axis=1)
    assert 1 <= np.count_nonzero(around > 0.95) <= 18
    dotted = around[(around > 0.05) & (around < 0.95)]
    assert len(dotted) >= 5
    rows = (around > 0.05) & (around < 0.95)
    assert all(blue[rows][:, left:left + 28].any() for left in range(0, blue.shape[1] - 28, 28))
    green = materials.leaves()(rng, 0.5, 0.5).astype(int)
    ground = np.rint(np.multiply((70, 120, 55), 0.35)).astype(int)
    assert np.mean((np.abs(green - ground) <= 1).all(axis=2)) < 0.05
    darkest = green[green.sum(axis=2) < np.quantile(green.sum(axis=2), 0.001)]
    np.testing.assert_allclose(darkest, np.broadcast_to(ground, darkest.shape), atol=14)
    assert np.mean(green[..., 1] > np.maximum(green[..., 0], green[..., 2])) > 0.97


def test_wallpaper_has_twigs_of_its_accents(rng):
    accent = (30.0, 30.0, 200.0)
    image = materials.wallpaper((220.0, 215.0, 200.0), (accent,))(rng, 2.0, 2.0)
    blue = image[..., 2].astype(int) > image[..., 0].astype(int) + 40
    assert 0.05 < blue.mean() < 0.4
    half = blue.shape[0] // 2
    assert min(part.mean() for rows in (blue[:half], blue[half:])
               for part in (rows[:, :half], rows[:, half:])) > 0.03  # strewn over all of it
