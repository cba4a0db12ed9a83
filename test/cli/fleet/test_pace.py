# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Servers that send at, below and above the pace that is required, by a clock of the tests."""

import pytest

from aick_ros.cli.fleet import pace
from aick_ros.cli.fleet.pace import SILENCE_LIMIT, SLOWEST, Pace, SilentServerError


@pytest.fixture
def clock(monkeypatch):
    """Return a list with the time in it."""
    now = [100.0]
    monkeypatch.setattr(pace.time, 'monotonic', lambda: now[0])
    return now


def send(clock, of, rate, seconds, step=0.5):
    for _ in range(round(seconds / step)):
        clock[0] += step
        of.add(round(rate * step))


@pytest.mark.parametrize('rate, is_too_slow', [
    (SLOWEST, False), (10 * SLOWEST, False), (SLOWEST - 10, True), (1, True), (0, True)])
@pytest.mark.parametrize('before', [0, 5 * SILENCE_LIMIT])
def test_a_server_keeps_the_pace_at_all_times(clock, rate, is_too_slow, before):
    sent = Pace('some://x')
    send(clock, sent, 2 * SLOWEST, before)
    if is_too_slow:
        with pytest.raises(SilentServerError, match='some://x hardly sends: '):
            send(clock, sent, rate, 3 * SILENCE_LIMIT)
        assert clock[0] - 100 - before <= 2 * SILENCE_LIMIT + 1
    else:
        send(clock, sent, rate, 100 * SILENCE_LIMIT)


def test_a_pause_within_the_limit_is_made_good(clock):
    sent = Pace('some://x')
    for _ in range(20):
        clock[0] += 0.9 * SILENCE_LIMIT
        sent.add(round(1.1 * SLOWEST * SILENCE_LIMIT))


def test_what_arrived_is_said(clock):
    sent = Pace('some://x')
    clock[0] += SILENCE_LIMIT
    sent.add(3)
    clock[0] += 2
    with pytest.raises(SilentServerError) as caught:
        sent.add(4)
    assert str(caught.value) == ('some://x hardly sends: 7 bytes arrived in 12 s; try later, or '
                                 'copy the recording yourself')


def test_the_pace_was_kept_once_a_window_is_full(clock):
    sent = Pace('some://x')
    sent.add(int(SLOWEST * SILENCE_LIMIT) - 1)
    assert not sent.was_kept
    sent.add(1)
    assert sent.was_kept
