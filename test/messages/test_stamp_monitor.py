# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Stray stamps in a stream, by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from aick_ros.geometry.stamps import MAX_STAMP
from aick_ros.messages.stamp_monitor import StampMonitor

SECOND = 10 ** 9
START = 1_700_000_000 * SECOND


def stray(seconds, arrivals=None):
    """Return which stamps [s after a start] are stray; they arrive when stamped."""
    monitor = StampMonitor()
    return ['far ahead of' in monitor.check(START + round(stamp * SECOND), arrival)
            for stamp, arrival in zip(seconds, arrivals or seconds)]


def test_one_stamp_far_ahead_is_stray():
    assert stray([0.0, 0.1, 99.0, 0.3, 0.4], [0.0, 0.1, 0.2, 0.3, 0.4]) == [
        False, False, True, False, False]


def test_stray_stamps_apart_are_each_stray():
    """The second is near the first, but regular images lie between them."""
    assert stray([0.0, 0.1, 99.0, 0.3, 99.5, 0.5], [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]) == [
        False, False, True, False, True, False]


def test_a_stray_stamp_in_a_pause_does_not_make_those_after_it_stray():
    """The time that has passed is that since the last accepted stamp."""
    assert stray([0.0, 0.1, 500.0, 60.0, 60.1], [0.0, 0.1, 59.9, 60.0, 60.1]) == [
        False, False, True, False, False]


@pytest.mark.parametrize('second', [98.0, 99.0 + 10.1])
def test_stray_stamps_in_succession_do_not_confirm_each_other(second):
    """A clock that was set runs on: at most 10 s to the next image, and never back."""
    assert stray([0.0, 0.1, 99.0, second, 0.4], [0.0, 0.1, 0.2, 0.3, 0.4]) == [
        False, False, True, True, False]


@pytest.mark.parametrize('ahead, expected', [(10.0, False), (10.001, True)])
def test_far_is_more_than_10_s_beyond_the_time_passed(ahead, expected):
    assert stray([0.0, 0.5 + ahead], [0.0, 0.5]) == [False, expected]


def test_a_clock_set_forward_costs_one_image():
    assert stray([0.0, 0.1, 99.2, 99.3, 99.4], [0.0, 0.1, 0.2, 0.3, 0.4]) == [
        False, False, True, False, False]


def test_a_pause_a_loop_and_a_fast_bag_have_no_stray_stamps():
    assert not any(stray([0.0, 0.1, 60.0, 60.1]))
    assert not any(stray([50.0, 50.1, 0.0, 0.1], [0.0, 0.1, 0.2, 0.3]))
    assert not any(stray([0.0, 5.0, 10.0, 15.0], [0.0, 0.01, 0.02, 0.03]))


@pytest.mark.parametrize('stamp', [0, -1])
def test_an_image_without_a_stamp_is_rejected(stamp):
    monitor = StampMonitor()
    assert monitor.check(stamp, 0.0) == (
        f'its stamp is {stamp} ns; the driver must stamp its images')
    assert monitor.check(START, 0.1) == ''


def test_missing_images_are_counted_without_the_stray_ones():
    monitor = StampMonitor()
    for index in [*range(60), 3000, *range(70, 130)]:
        monitor.check(START + index * SECOND // 30, index / 30 if index < 3000 else 2.1)
    assert monitor.missing == 10
    assert monitor.missing_share == pytest.approx(10 / 110)


def test_the_end_of_time_is_never_a_clock_that_was_set():
    monitor = StampMonitor()
    assert monitor.check(START, 0.0) == ''
    for i in range(5):
        assert 'the last second' in monitor.check((2 ** 31 - 1) * SECOND + i, 0.1 * i)
    assert monitor.check(MAX_STAMP, 0.5) != ''
    assert monitor.check(START + SECOND, 1.0) == ''


@given(st.lists(st.tuples(st.integers(-10, 2 ** 64), st.floats(0.0, 1e6))))
def test_any_stamps_are_judged_and_images_of_a_second_later_are_taken(images):
    """Whatever came before, at most one image of a regular stream is dropped."""
    monitor = StampMonitor()
    for stamp, now in images:
        assert isinstance(monitor.check(stamp, now), str)
    monitor.check(START, 2e6)
    assert monitor.check(START + SECOND, 2e6 + 1.0) == ''


def test_a_stray_stamp_is_forgotten_by_the_next_good_one():
    """Far ahead, then a good one, then near the stray one again: that is stray as well."""
    assert stray([0.0, 99.0, 0.2, 99.3], [0.0, 0.1, 0.2, 0.3]) == [False, True, False, True]


@pytest.mark.parametrize('second, confirms', [(99.0, True), (109.0, True), (98.999, False),
                                              (109.001, False)])
def test_the_next_one_confirms_from_0_to_10_s_later(second, confirms):
    assert stray([0.0, 99.0, second], [0.0, 0.1, 0.2]) == [False, True, not confirms]


def test_sentences_have_the_stamp():
    monitor = StampMonitor()
    assert monitor.check(2 ** 31 * SECOND - 5, 0.0) == (
        f'its stamp of {2 ** 31 * SECOND - 5} ns is in the last second that a message can have; '
        'the driver must stamp its images')
    monitor.check(START, 0.0)
    assert monitor.check(START + 60 * SECOND, 0.1) == (
        f'its stamp of {START + 60 * SECOND} ns is far ahead of those before; if the clock was '
        'set, the next one is taken')


@pytest.mark.parametrize('stamp, is_good', [
    (1, True), (MAX_STAMP - SECOND, True), (MAX_STAMP - SECOND + 1, False)])
def test_stamps_are_good_from_1_to_a_second_before_the_end(stamp, is_good):
    assert (StampMonitor().check(stamp, 0.0) == '') is is_good
