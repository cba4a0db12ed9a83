# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Frames that are the next ones, and those that come too late."""

import pytest

from aick_ros.odometry.frame_order import FrameOrder


@pytest.mark.parametrize('stamp', [-5, 0, 7])
def test_no_stamp_is_next_or_late_before_the_first_frame(stamp):
    order = FrameOrder()
    assert not order.is_next(stamp) and order.back(stamp) is None
    assert order.unchanged_since(stamp) == stamp


@pytest.mark.parametrize('first', [0, 100])
def test_a_stamp_is_next_or_goes_back_or_repeats(first):
    order = FrameOrder()
    order.advance(first)
    assert order.is_next(first + 1) and order.back(first + 1) is None
    assert not order.is_next(first) and order.back(first) == 0
    assert not order.is_next(first - 3) and order.back(first - 3) == 3


def test_images_are_unchanged_since_the_last_new_ones():
    order = FrameOrder()
    order.advance(0)
    order.advance(5)
    for stamp in (7, 9):
        order.advance(stamp, is_new=False)
        assert order.unchanged_since(stamp + 1) == 5
    assert order.back(8) == 1
    order.advance(11)
    assert order.unchanged_since(12) == 11
