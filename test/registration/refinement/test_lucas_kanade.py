# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Tracked pixels of an image that is shifted by a known amount."""

import cv2
import numpy as np
import pytest

from aick_ros.registration.refinement.lucas_kanade import track_there_and_back

HEIGHT, WIDTH = 160, 200


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


@pytest.mark.parametrize('shift', [(0, 0), (3, -2), (-6, 5)])
def test_pixels_move_with_the_image(texture, shift):
    start = pixels()
    kept = start.copy()
    seen, found = track_there_and_back(view(texture), view(texture, *shift), start, 15, 2)
    assert found.all()
    np.testing.assert_allclose(seen, start + shift, atol=0.1)
    np.testing.assert_array_equal(start, kept)


def test_a_large_shift_requires_levels_or_an_expectation(texture):
    shift, start = (26, 0), pixels()
    images = view(texture), view(texture, *shift)
    _, found = track_there_and_back(*images, start, 11, 0)
    assert found.mean() < 0.2
    seen, found = track_there_and_back(*images, start, 11, 3)
    assert found.mean() > 0.8
    np.testing.assert_allclose(seen[found], start[found] + shift, atol=0.2)
    expected = (start + (25, 1)).astype(np.float32)
    seen, found = track_there_and_back(*images, start, 11, 0, expected)
    assert found.all()
    np.testing.assert_allclose(seen, start + shift, atol=0.1)


def test_the_expected_places_are_not_changed(texture):
    start = pixels()
    expected = start + np.float32(2)
    kept = expected.copy()
    track_there_and_back(view(texture), view(texture, 2, 2), start, 15, 1, expected)
    np.testing.assert_array_equal(expected, kept)


@pytest.mark.parametrize('has_expected', [False, True])
def test_what_is_covered_in_the_other_image_does_not_track_back(texture, has_expected):
    """Half of the second image shows another part of the texture."""
    before, now = view(texture), view(texture)
    now[:, :WIDTH // 2] = view(texture[::-1, ::-1])[:, :WIDTH // 2]
    start = pixels()
    seen, found = track_there_and_back(before, now, start, 11, 1, start if has_expected else None)
    left, right = start[:, 0] < WIDTH // 2 - 15, start[:, 0] > WIDTH // 2 + 15
    assert found[right].all()
    assert found[left].mean() < 0.3


def test_a_pixel_is_kept_up_to_half_a_pixel_from_its_start(monkeypatch):
    """Along u or along v, whichever is more."""
    returns = np.array([[0.45, 0], [0, 0.55], [0.45, 0.45], [-0.55, 0], [0, -0.45], [0.5, 0]])
    start = np.full((6, 2), 8, np.float32)
    answers = iter([(start + 1, [1, 1, 1, 1, 1, 1]), (start + returns, [1, 1, 1, 1, 1, 1])])
    tracked_by(monkeypatch, answers)
    _, found = track_there_and_back(None, None, start, 5, 0)
    assert found.tolist() == [True, False, True, False, True, False]


def test_a_pixel_has_to_be_found_both_ways(monkeypatch):
    start = np.full((4, 2), 8, np.float32)
    tracked_by(monkeypatch, iter([(start + 3, [1, 0, 1, 0]), (start, [1, 1, 0, 0])]))
    seen, found = track_there_and_back(None, None, start, 5, 0)
    assert found.tolist() == [True, False, False, False]
    np.testing.assert_array_equal(seen, start + 3)


def tracked_by(monkeypatch, answers):
    """Let OpenCV answer with these pixels and statuses."""
    def track(*_, **__):
        seen, status = next(answers)
        return (np.float32(seen).reshape(-1, 1, 2), np.array(status, np.uint8)[:, None], None)
    monkeypatch.setattr(cv2, 'calcOpticalFlowPyrLK', track)


def test_no_pixels_are_no_tracks(texture):
    seen, found = track_there_and_back(view(texture), view(texture), np.empty((0, 2), np.float32),
                                       15, 2)
    assert seen.shape == (0, 2) and found.shape == (0,) and found.dtype == bool
