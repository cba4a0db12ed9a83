# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""When messages are due, by a clock that only sleeping moves."""

import io
import math
import sys

import pytest

from aick_ros.ros.playback import pace
from aick_ros.ros.playback.pace import RealTime, StepByStep

START = 10 ** 12


class Time:
    def __init__(self):
        self.now = 50.0

    def monotonic(self):
        return self.now

    def sleep(self, duration):
        assert duration > 0
        self.now += duration


@pytest.fixture
def time(monkeypatch):
    time = Time()
    monkeypatch.setattr(pace, 'time', time)
    return time


@pytest.mark.parametrize('rate', [0.5, 1.0, 4.0])
def test_messages_are_due_as_recorded_at_the_rate(time, rate):
    is_due = RealTime(rate)
    for i in range(10):
        is_due(START + i * 20_000_000)
        assert time.now == pytest.approx(50.0 + 0.02 * i / rate)


def test_a_delay_is_made_up_for(time):
    is_due = RealTime()
    is_due(START)
    time.now += 0.05
    is_due(START + 20_000_000)
    assert time.now == pytest.approx(50.05)
    is_due(START + 60_000_000)
    assert time.now == pytest.approx(50.06)


def test_at_an_infinite_rate_nothing_waits(time):
    is_due = RealTime(math.inf)
    for i in range(10):
        is_due(START + i * 10 ** 9)
    assert time.now == 50.0


def test_messages_of_another_century_are_no_error(time):
    is_due = RealTime(0.001)
    is_due(0)
    is_due(2 ** 62)
    assert time.now == 50.0 + 86400.0


def test_a_step_takes_the_messages_of_20_ms(monkeypatch):
    lines = io.StringIO('\n' * 2)
    monkeypatch.setattr(sys, 'stdin', lines)
    is_due = StepByStep()
    for stamp, read in ((0, 1), (20_000_000, 1), (20_000_001, 2), (30_000_000, 2)):
        is_due(START + stamp)
        assert lines.tell() == read
    with pytest.raises(EOFError):
        is_due(START + 10 ** 9)
