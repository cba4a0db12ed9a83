# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracked pixels of an image that is shifted by a known amount."""

import cv2
import numpy as np
import pytest

from aick_ros import kernels
from aick_ros.features.mirrored_border import with_border
from aick_ros.registration.refinement.lucas_kanade import (
    Pyramid, _track, inverted, track_coarsely, track_there_and_back)

HEIGHT, WIDTH = 160, 200
FLAT = Pyramid(np.zeros((HEIGHT, WIDTH), np.uint8), 5, 0)


@pytest.fixture(scope='module')
def texture():
    """Return smooth noise, larger than an image."""
    rng = np.random.default_rng(1)
    noise = cv2.GaussianBlur(rng.random((HEIGHT + 80, WIDTH + 80)), (0, 0), 2.0)
    return cv2.normalize(noise, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)


def view(texture, right=0, down=0):
    """Return an image in which all of the scene has moved to the right and down [px]."""
    return np.ascontiguousarray(
        texture[40 - down:40 - down + HEIGHT, 40 - right:40 - right + WIDTH])


def pixels(step=20, margin=40):
    u, v = np.meshgrid(np.arange(margin, WIDTH - margin, step),
                       np.arange(margin, HEIGHT - margin, step))
    return np.column_stack([u.ravel(), v.ravel()]).astype(np.float32)


def track(before, now, start, window, levels, expected=None):
    pyramids = (Pyramid(image, window, levels) for image in (before, now))
    return track_there_and_back(*pyramids, start, expected)


@pytest.mark.parametrize('shift', [(0, 0), (3, -2), (-6, 5)])
def test_pixels_move_with_the_image(texture, shift):
    start = pixels()
    kept = start.copy()
    seen, found = track(view(texture), view(texture, *shift), start, 15, 2)
    assert found.all()
    np.testing.assert_allclose(seen, start + shift, atol=0.1)
    np.testing.assert_array_equal(start, kept)


def test_a_large_shift_requires_levels_or_an_expectation(texture):
    shift, start = (26, 0), pixels()
    images = view(texture), view(texture, *shift)
    _, found = track(*images, start, 11, 0)
    assert found.mean() < 0.2
    seen, found = track(*images, start, 11, 3)
    assert found.mean() > 0.8
    np.testing.assert_allclose(seen[found], start[found] + shift, atol=0.2)
    expected = (start + (25, 1)).astype(np.float32)
    seen, found = track(*images, start, 11, 0, expected)
    assert found.all()
    np.testing.assert_allclose(seen, start + shift, atol=0.1)


def test_from_nearby_pixels_are_sought_at_full_resolution_alone(texture, monkeypatch):
    images = [Pyramid(view(texture, *shift), 9, 2) for shift in ((0, 0), (5, -3))]
    start, levels = pixels(), []
    align = kernels.align_windows
    monkeypatch.setattr(kernels, 'align_windows', lambda *given: (
        levels.append(given[5]), align(*given)))
    seen, found = track_there_and_back(
        *images, start, (start + (4, -2)).astype(np.float32), is_near=True)
    assert found.all() and levels == [1.0, 1.0]
    np.testing.assert_allclose(seen, start + (5, -3), atol=0.1)
    _, found = track_there_and_back(
        *images, start, (start + (-12, 9)).astype(np.float32), is_near=True)
    assert found.mean() < 0.2 and levels == 4 * [1.0]  # they are not sought again


@pytest.mark.parametrize('levels, passed', [(3, [0.125, 0.25, 0.5]), (1, [0.5]), (0, [1.0])])
def test_coarse_tracking_ends_at_half_of_the_resolution(texture, monkeypatch, levels, passed):
    """It reaches as far as its levels, and is right to half a pixel."""
    images = [Pyramid(view(texture, *shift), 11, levels) for shift in ((0, 0), (7, -4))]
    start, scales = pixels(), []
    align = kernels.align_windows
    monkeypatch.setattr(kernels, 'align_windows', lambda *given: (
        scales.append(given[5]), align(*given)))
    seen, found = track_coarsely(*images, start, start + np.float32(1.0))
    assert scales == passed
    if levels:
        assert found.mean() > 0.9
        assert np.median(np.linalg.norm(seen[found] - start[found] - (7, -4), axis=1)) < 0.3


@pytest.mark.parametrize('width, levels', [(320, 2), (640, 2), (801, 3), (1280, 3), (3840, 3)])
def test_expected_pixels_are_sought_at_first_in_small_images(monkeypatch, width, levels):
    """All levels are used where they are not found there, or where none is expected."""
    sought = []

    def align(before, now, border, side, last_step, scale, pixels, turns, places, found):
        sought.append(before.shape[1] - 2 * border)
        found[:] = len(sought) > all_found_after

    monkeypatch.setattr(kernels, 'align_windows', align)
    pyramids = [Pyramid(np.zeros((240, width), np.uint8), 9, 2) for _ in range(2)]
    start = np.full((5, 2), 20, np.float32)
    sizes = [-(-width // 2 ** k) for k in range(3)]
    for expected, all_found_after, searches in (
            (start, 0, [levels]), (start, 99, [levels, 3] if levels < 3 else [3]),
            (None, 0, [3])):
        sought.clear()
        track_there_and_back(*pyramids, start, expected)
        back = [sizes[0]] if expected is not None else sizes[::-1]
        assert sought == [width for count in searches
                          for width in (*sizes[:count][::-1], *back)]


@pytest.mark.parametrize('share, searches', [(0.3, 2 + 1), (0.6, 2 + 1 + 4 + 1)])
def test_a_few_pixels_that_are_not_found_do_not_require_another_search(
        monkeypatch, texture, share, searches):
    """Those of a part of the image that shows another scene."""
    align, calls = kernels.align_windows, []
    monkeypatch.setattr(kernels, 'align_windows', lambda *args: calls.append(align(*args)))
    start, now, edge = pixels(9), view(texture, 3, 1), int(share * WIDTH)
    now[:, :edge] = view(texture[::-1, ::-1])[:, :edge]
    seen, found = track(view(texture), now, start, 9, 3, start)
    assert 0.2 < found.mean() < 0.9
    right = found & (start[:, 0] > edge + 10)
    np.testing.assert_allclose(seen[right], start[right] + (3, 1), atol=0.1)
    assert len(calls) == searches


def test_the_expected_places_are_not_changed(texture):
    start = pixels()
    expected = start + np.float32(2)
    kept = expected.copy()
    track(view(texture), view(texture, 2, 2), start, 15, 1, expected)
    np.testing.assert_array_equal(expected, kept)


@pytest.mark.parametrize('has_expected', [False, True])
def test_what_is_covered_in_the_other_image_does_not_track_back(texture, has_expected):
    """Half of the second image shows another part of the texture."""
    before, now = view(texture), view(texture)
    now[:, :WIDTH // 2] = view(texture[::-1, ::-1])[:, :WIDTH // 2]
    start = pixels()
    seen, found = track(before, now, start, 11, 1, start if has_expected else None)
    left, right = start[:, 0] < WIDTH // 2 - 15, start[:, 0] > WIDTH // 2 + 15
    assert found[right].all()
    assert found[left].mean() < 0.3


@pytest.mark.parametrize('window', [5, 8, 9, 16, 21, 51])
@pytest.mark.parametrize('levels', [0, 2])
def test_it_finds_what_opencv_finds(texture, window, levels):
    """To the fifth binary digit of a grey level, to which OpenCV rounds."""
    before = view(texture)
    turn = cv2.getRotationMatrix2D((WIDTH / 2, HEIGHT / 2), 1.0, 1.01)
    now = cv2.warpAffine(before, turn, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT_101)
    start = pixels(9) + np.float32(0.3)
    expected = (start + (1.2, -0.7)).astype(np.float32)
    seen, found = _track(*(Pyramid(image, window, levels) for image in (before, now)), start,
                         expected, None,
                         range(len(Pyramid(before, window, levels).sizes)), 0.03)
    known, status, _ = cv2.calcOpticalFlowPyrLK(
        before, now, start[:, None], expected[:, None].copy(), winSize=(window, window),
        maxLevel=levels, criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 0.03),
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW)
    known, is_known = known[:, 0], status[:, 0] > 0
    assert (found == is_known).mean() > 0.98
    errors = np.linalg.norm(seen - known, axis=1)[found & is_known]
    assert np.median(errors) < 3e-3
    assert (errors < 0.05).mean() > 0.97


def drawn(waves, phases, u, v):
    """Return an image of waves that shows at its pixels what is at places u, v."""
    phase = waves[:, 0, None, None] * u + waves[:, 1, None, None] * v + phases[:, None, None]
    return np.clip(128 + 8 * np.sin(phase).sum(axis=0), 0, 255).round().astype(np.uint8)


@pytest.mark.parametrize('turn', [
    [[1.0, 0.0], [0.0, 1.0]], [[0.0, -1.0], [1.0, 0.0]], [[0.7, -0.6], [0.5, 0.9]],
    [[-1.1, 0.1], [0.2, 0.9]]])
@pytest.mark.parametrize('window', [9, 16])
def test_windows_that_are_turned_and_stretched(turn, window):
    """About the centre of the image; those that a turn takes out of it are left out."""
    rng = np.random.default_rng(3)
    waves, phases = rng.uniform(-0.35, 0.35, (30, 2)), rng.uniform(0, 2 * np.pi, 30)
    centre = np.array([WIDTH / 2 + 0.3, HEIGHT / 2 - 0.4])
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    back = np.linalg.inv(turn)
    offsets = np.stack([u, v], axis=2) - centre
    now = drawn(waves, phases, *np.moveaxis(offsets @ back.T + centre, 2, 0))
    pyramids = [Pyramid(image, window, 2) for image in (drawn(waves, phases, u, v), now)]
    start = pixels(9, 16)
    there = (start - centre) @ np.transpose(turn) + centre
    inside = ((there > 16) & (there < (WIDTH - 16, HEIGHT - 16))).all(axis=1)
    start, there = start[inside], there[inside]
    expected = np.float32(there + (1.4, -1.2))
    seen, found = track_there_and_back(*pyramids, start, expected,
                                       np.tile(turn, (len(start), 1, 1)))
    assert found.mean() > 0.95 and len(start) > 60
    assert np.median(np.abs(seen - there)[found]) < 0.02
    assert (np.abs(seen - there)[found] < 0.1).mean() > 0.98
    if np.trace(turn) < 1.5:  # they are not found as they are
        assert track_there_and_back(*pyramids, start, expected)[1].mean() < 0.5


@pytest.mark.parametrize('turn', [
    [[np.nan, 0], [0, 1]], [[0, 0], [0, 0]], [[1, 1], [1, 1]], [[1e-3, 0], [0, 1]],
    [[np.inf, 0], [0, 1]], [[1e30, 0], [0, 1e30]]])
def test_windows_are_not_found_that_no_border_has(texture, turn):
    image, start = Pyramid(view(texture), 9, 2), np.float32([[60, 60], [80, 50]])
    turns = np.array([np.eye(2), turn])
    seen, found = track_there_and_back(image, image, start, start, turns)
    assert found.tolist() == [True, False]


def test_windows_that_are_not_warped_are_upright(texture):
    images = [Pyramid(view(texture, *shift), 9, 2) for shift in ((0, 0), (5, -3))]
    start, upright = pixels(), np.tile(np.eye(2), (len(pixels()), 1, 1))
    for expected, known in zip(track_there_and_back(*images, start, start, None),
                               track_there_and_back(*images, start, start, upright)):
        np.testing.assert_array_equal(expected, known)


def test_warps_back():
    turns = np.random.default_rng(1).normal(size=(20, 2, 2))
    np.testing.assert_allclose(inverted(turns) @ turns, np.tile(np.eye(2), (20, 1, 1)), atol=1e-9)
    assert inverted(None) is None
    assert not np.isfinite(inverted(np.ones((1, 2, 2)))).any()
    with pytest.raises(ValueError, match='the warps has 60 numbers: 80 are required'):
        inverted(np.ones((20, 3)))


@pytest.mark.parametrize('move', [(0.37, -0.61), (-0.5, 0.5), (0.05, 0.95)])
def test_fractions_of_a_pixel(move):
    """Of waves that are drawn where they are, to what grey levels are rounded to."""
    rng = np.random.default_rng(3)
    waves = rng.uniform(-0.35, 0.35, (30, 2))
    phases = rng.uniform(0, 2 * np.pi, 30)
    v, u = np.mgrid[:HEIGHT, :WIDTH]

    def image(right, down):
        return drawn(waves, phases, u - right, v - down)

    start = pixels()
    seen, found = track(image(0, 0), image(*move), start, 9, 2, start)
    assert found.all()
    errors = seen - start - move
    np.testing.assert_allclose(np.median(errors, axis=0), 0, atol=0.02)
    assert np.abs(errors).max() < 0.15


def test_an_image_without_texture_shows_no_pixel():
    flat = np.full((HEIGHT, WIDTH), 90, np.uint8)
    assert not track(flat, flat, pixels(), 9, 2)[1].any()
    edge = flat.copy()
    edge[:, WIDTH // 2:] = 200  # shows where it is along one direction
    start = np.float32([[WIDTH // 2, HEIGHT // 2]])
    assert not track(edge, edge, start, 9, 0)[1].any()
    edge[HEIGHT // 2:] = 20
    assert track(edge, edge, start, 9, 0)[1].all()


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('place', [(np.nan, 50), (50, np.inf), (-np.inf, 50), (1e30, 50),
                                   (-80, 50), (50, HEIGHT + 80)])
def test_what_is_nowhere_in_an_image_is_not_found(texture, place):
    """Neither in the one that it is tracked from, nor in the other."""
    image = view(texture)
    inside, outside = np.float32([[60, 60], [50, 50]]), np.float32([[60, 60], place])
    for start, expected in ((outside, inside), (inside, outside)):
        _, found = track(image, image, start, 9, 2, expected)
        assert found.tolist() == [True, False]


def test_windows_reach_beyond_the_edge_of_an_image(texture):
    image = view(texture)
    corners = np.float32([[0, 0], [WIDTH - 1, 0], [0, HEIGHT - 1], [WIDTH - 1, HEIGHT - 1]])
    seen, found = track(image, image, corners, 9, 2, corners)
    assert found.all()
    np.testing.assert_allclose(seen, corners, atol=1e-3)


@pytest.mark.parametrize('shape, levels', [((160, 200), 3), ((160, 18), 1), ((36, 200), 2)])
def test_a_pyramid_ends_where_its_images_are_as_small_as_a_window(shape, levels):
    pyramid = Pyramid(np.zeros(shape, np.uint8), 9, 2)
    sizes = [tuple(-(-side // 2 ** k) for side in shape) for k in range(levels)]
    assert pyramid.sizes == sizes
    border = 2 * pyramid.border
    for k in reversed(range(levels)):
        assert tuple(np.subtract(pyramid.level(k).shape, border)) == sizes[k]


@pytest.mark.parametrize('height', [19, 20, 31, 160])
@pytest.mark.parametrize('width', [19, 33, 200, 641])
def test_smaller_images_are_those_of_opencv_with_a_mirrored_border(height, width):
    """Extremes round as the others do; a border wider than the image is mirrored again."""
    image = np.random.default_rng(height).integers(0, 256, (height, width), np.uint8)
    image[:6, :9], image[-6:, -9:] = 255, 0
    pyramid = Pyramid(image, 9, 2)
    for number in range(1, len(pyramid.sizes)):
        image = cv2.pyrDown(image)
        np.testing.assert_array_equal(pyramid.level(number), with_border(image, pyramid.border))


@pytest.mark.parametrize('shape', [(100, 61), (99, 60), (3, 3)])
def test_an_image_that_is_not_half_as_large_is_refused(shape):
    border = 4
    image, smaller = (np.zeros(np.add(sides, 2 * border), np.uint8)
                      for sides in ((200, 120), shape))
    with pytest.raises(ValueError, match='not half as large'):
        kernels.halve(image, border, smaller)


def test_a_pixel_is_kept_up_to_half_a_pixel_from_its_start(monkeypatch):
    """Along u or along v, whichever is more."""
    returns = np.array([[0.45, 0], [0, 0.55], [0.45, 0.45], [-0.55, 0], [0, -0.45], [0.5, 0]])
    start = np.full((6, 2), 8, np.float32)
    answers = iter([(start + 1, [1, 1, 1, 1, 1, 1]), (start + returns, [1, 1, 1, 1, 1, 1])])
    tracked_by(monkeypatch, answers)
    _, found = track_there_and_back(FLAT, FLAT, start)
    assert found.tolist() == [True, False, True, False, True, False]


def test_a_pixel_has_to_be_found_both_ways(monkeypatch):
    start = np.full((4, 2), 8, np.float32)
    tracked_by(monkeypatch, iter([(start + 3, [1, 0, 1, 0]), (start, [1, 1, 0, 0])]))
    seen, found = track_there_and_back(FLAT, FLAT, start)
    assert found.tolist() == [True, False, False, False]
    np.testing.assert_array_equal(seen, start + 3)


def tracked_by(monkeypatch, answers):
    """Let windows be found at these pixels, or not."""
    def align(before, now, border, side, last_step, scale, pixels, turns, places, found):
        places[:], found[:] = next(answers)
    monkeypatch.setattr(kernels, 'align_windows', align)


def test_no_pixels_are_no_tracks(texture):
    seen, found = track(view(texture), view(texture), np.empty((0, 2), np.float32), 15, 2)
    assert seen.shape == (0, 2) and found.shape == (0,) and found.dtype == bool
