# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Waits for transforms: which of them make a sentence."""

import pytest

from aick_ros.ros.input.lateness import Lateness


class Waits:
    """Waits at a rate of 10 Hz."""

    def __init__(self):
        self.now = 100.0
        self.lateness = Lateness(clock=lambda: self.now)

    def wait(self, seconds, count=1, source='camera'):
        for _ in range(count):
            self.lateness.note('base_link', source, seconds)
            self.now += 0.1
        return self.lateness.complaint


def sentence(seconds, source='camera'):
    return (f"the transform from '{source}' to 'base_link' arrives {seconds} s after the frames "
            'that need it, which wait up to wait_for_transform: publish it sooner and more often, '
            'and check that the clocks agree')


def test_long_waits_are_reported_with_their_median():
    waits = Waits()
    assert waits.wait(0.35, 2) == ''
    waits.wait(0.25, 2)
    waits.wait(0.01, 20)
    assert waits.wait(0.31) == sentence('0.31')


@pytest.mark.parametrize('seconds, is_long', [(0.05, False), (0.051, True)])
def test_up_to_a_twentieth_of_a_second_is_not_late(seconds, is_long):
    assert bool(Waits().wait(seconds, 10)) is is_long


@pytest.mark.parametrize('short, is_reported', [(57, True), (58, False)])
def test_one_in_twenty_may_be_long(short, is_reported):
    waits = Waits()
    waits.wait(0.2, 3)
    assert bool(waits.wait(0.0, short)) is is_reported


def test_after_ten_seconds_a_wait_is_forgotten():
    waits = Waits()
    waits.wait(0.2, 5)
    waits.now += 9.7
    assert waits.lateness.complaint == sentence('0.20')
    waits.now += 0.1
    assert waits.lateness.complaint == ''


def test_each_transform_has_its_own_sentence():
    waits = Waits()
    waits.wait(0.0, 100, source='wheel')
    for source, seconds in (('wheel', 0.0), ('pan', 0.2), ('camera', 0.3)):
        waits.wait(seconds, 3, source)
    waits.now -= 5.0
    assert waits.lateness.complaint == f"{sentence('0.30')}; {sentence('0.20', 'pan')}"
