# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Which images of a frame repeat, against images that differ in one bit."""

import dataclasses

import numpy as np
import pytest

from aick_ros.frames.repetition import Repeat, repeat_of
from aick_ros.frames.rgbd import RgbdFrame
from aick_ros.geometry.camera import Camera

SHAPE = 12, 16


@pytest.fixture
def frame():
    rng = np.random.default_rng(0)
    depth = rng.uniform(1, 2, SHAPE).astype(np.float32)
    depth[3:6] = np.nan
    return RgbdFrame(0, rng.integers(0, 256, (*SHAPE, 3)).astype(np.uint8), depth,
                     Camera(*SHAPE[::-1], 20.0, 20.0, 8.0, 6.0))


def again(frame, colour=(), depth=()):
    """Return the images once more in other memory, changed at some pixels by the least step."""
    images = [frame.colour.copy(), frame.depth.copy()]
    for pixel in colour:
        images[0][pixel] ^= 1
    for pixel in depth:
        images[1][pixel] = np.nextafter(images[1][pixel], np.float32(9))
    return dataclasses.replace(frame, stamp=1, colour=images[0], depth=images[1])


@pytest.mark.parametrize('changes, repeat', [
    ({}, Repeat.BOTH),
    ({'depth': [(0, 0)]}, Repeat.COLOUR),
    ({'colour': [(11, 15, 2)]}, Repeat.DEPTH),
    ({'colour': [(0, 0, 0)], 'depth': [(11, 15)]}, Repeat.NONE)])
def test_one_bit_makes_another_image(frame, changes, repeat):
    assert repeat_of(again(frame, **changes), frame) is repeat


def test_what_shows_nothing_does_not_repeat(frame):
    covered = dataclasses.replace(frame, colour=np.zeros_like(frame.colour),
                                  depth=np.full_like(frame.depth, np.nan))
    assert repeat_of(again(covered), covered) is Repeat.NONE


@pytest.mark.parametrize('covered', ['colour', 'depth'])
def test_where_one_image_shows_nothing_the_other_one_says_whether_both_repeat(frame, covered):
    nothing = np.zeros_like(frame.colour) if covered == 'colour' else np.full_like(
        frame.depth, np.nan)
    before = dataclasses.replace(frame, **{covered: nothing})
    changed = {'colour': [(0, 0, 0)]} if covered == 'depth' else {'depth': [(0, 0)]}
    assert repeat_of(again(before), before) is Repeat.BOTH
    assert repeat_of(again(before, **changed), before) is Repeat.NONE


def test_another_resolution_is_another_image(frame):
    half = dataclasses.replace(frame, colour=frame.colour[:6], depth=frame.depth[:6],
                               camera=Camera(16, 6, 20.0, 20.0, 8.0, 3.0))
    assert repeat_of(half, frame) is Repeat.NONE


def test_repeats_are_described_for_people():
    assert {repeat.name: repeat.value for repeat in Repeat} == {
        'NONE': 'no image repeats', 'COLOUR': 'the colour image repeats',
        'DEPTH': 'the depth image repeats', 'BOTH': 'both images repeat'}
