# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Where dots and lines of a picture are, and of which colour."""

from types import SimpleNamespace

import numpy as np
import pytest

from aick_ros.registration.status import Status
from aick_ros.ros.output.debug_image import draw_matches

GREY = 100
PIXELS = np.array([[20.0, 20.0], [60.0, 20.0], [40.25, 50.0]], np.float32)
REFERENCE = np.array([[70.0, 45.0], [20.0, 60.0]], np.float32)
MATCHES = np.array([[0, 1]])  # from (20, 20) to (20, 60)


def update(status=Status.OK, has_reference=True, matches=MATCHES):
    return SimpleNamespace(
        keypoints=SimpleNamespace(pixels=PIXELS), matches=matches, status=status, reason='why',
        reference=SimpleNamespace(pixels=REFERENCE) if has_reference else None)


def drawn(shape=(100, 100, 3), **parts):
    return draw_matches(np.full(shape, GREY, np.uint8), update(**parts)).astype(int)


def green(picture):
    """Return where green is the strongest, by more than rounding."""
    return (picture[:80, :, 1] - np.maximum(picture[:80, :, 0], picture[:80, :, 2]) > 40)


def red(picture):
    return (picture[:80, :, 0] - picture[:80, :, 2] > 40) & ~green(picture)


def centre(mask):
    v, u = np.nonzero(mask)
    return u.mean(), v.mean()


@pytest.mark.parametrize('shape', [(100, 100, 3), (100, 100)])
def test_a_line_leads_from_a_keypoint_to_its_match_in_the_reference(shape):
    picture = drawn(shape)
    assert picture.shape == (100, 100, 3)
    mask = green(picture)
    assert mask[25:60, 20].all()  # along all of the way
    assert not mask[:, 24:].any() and not mask[65:].any()
    assert mask[18, 20] and mask[22, 20]  # a ring of two pixels about the keypoint


def test_keypoints_without_a_match_have_rings_of_another_colour():
    mask = red(drawn())
    for u, v in PIXELS[1:]:
        ring = np.zeros_like(mask)
        ring[int(v) - 4:int(v) + 5, int(u) - 4:int(u) + 5] = True
        assert centre(mask & ring) == (pytest.approx(u, abs=0.3), pytest.approx(v, abs=0.3))
        mask = mask & ~ring
    assert not mask.any()


def test_without_a_reference_all_are_keypoints_only():
    picture = drawn(has_reference=False, matches=np.empty((0, 2), np.intp))
    assert not green(picture).any()
    assert red(picture)[15:26, 15:26].any()


@pytest.mark.parametrize('status, channel', [(Status.OK, 1), (Status.TOO_FEW_MATCHES, 0)])
def test_the_caption_is_green_where_the_pose_was_measured_else_red(status, channel):
    strip = drawn(status=status)[-16:]
    assert (strip[0] == GREY // 4).all()
    assert strip[..., channel].max() > 150 > strip[..., 1 - channel].max()
    assert (drawn(status=status)[-17] == GREY).all()


def test_the_image_itself_stays():
    image = np.full((100, 100, 3), GREY, np.uint8)
    draw_matches(image, update())
    assert (image == GREY).all()
