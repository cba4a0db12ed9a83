# SPDX-FileCopyrightText: 2026 The aick_ros authors
# SPDX-License-Identifier: Apache-2.0

"""Ends of a recording: its last frame, a limit, the user, damage."""

import signal
import threading

import pytest

from aick_ros.cli.input.damage_log import DamageLog
from aick_ros.cli.input.interruption import Interruption
from aick_ros.cli.input.reading import COMPLETE, INTERRUPTED, Reading
from aick_ros.errors import InputError
from aick_ros.sources import raise_damage


def broken_at(number):
    def on_frame(index, on_damaged):
        if index == number:
            raise InputError('the index is broken')
    return on_frame


def read(reading):
    return [frame.stamp for frame in reading.frames(raise_damage)]


@pytest.fixture
def stamps(recording):
    return [frame.stamp for frame in recording.frames(raise_damage)]


def test_reads_all(recording, stamps):
    reading = Reading(recording, None)
    assert (reading.name, len(reading)) == (recording.name, len(recording))
    assert reading.ground_truth is recording.ground_truth
    assert read(reading) == stamps
    assert read(reading) == stamps
    assert reading.ended == COMPLETE


@pytest.mark.parametrize('ahead', [True, False])
def test_reads_ahead_in_a_thread_of_its_own_or_not_at_all(recording, in_memory, stamps, ahead):
    threads = set()
    frames = list(recording.frames(raise_damage))
    source = in_memory(frames, on_frame=lambda *_: threads.add(threading.current_thread()))
    assert read(Reading(source, None, ahead=ahead)) == stamps
    assert len(threads) == 1 and (threading.current_thread() in threads) != ahead


@pytest.mark.parametrize('limit', [1, 5, 100])
def test_reads_no_more_than_the_limit(recording, stamps, limit):
    reading = Reading(recording, limit)
    assert len(reading) == min(limit, len(stamps))
    assert read(reading) == stamps[:limit]
    assert reading.ended == COMPLETE


def test_ends_where_the_user_wants_to(recording, stamps, capfd):
    seen = []
    before = signal.getsignal(signal.SIGINT)
    with Reading(recording, None) as reading:
        for frame in reading.frames(raise_damage):
            seen.append(frame.stamp)
            if len(seen) == 3:
                signal.raise_signal(signal.SIGINT)
    assert seen == stamps[:3]
    assert reading.ended == INTERRUPTED
    assert capfd.readouterr().err == ('aick: interrupted: the output is completed up to this '
                                      'point, Ctrl-C again ends at once\n')
    assert signal.getsignal(signal.SIGINT) is before


ENDINGS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.usefixtures('terminal')
@pytest.mark.parametrize('first', ENDINGS)
@pytest.mark.parametrize('second', ENDINGS)
def test_second_interruption_ends_at_once(first, second):
    before = [signal.getsignal(ending) for ending in ENDINGS]
    with Interruption() as interruption:
        signal.raise_signal(first)
        assert interruption.requested
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(second)
    assert [signal.getsignal(ending) for ending in ENDINGS] == before


def test_a_hang_up_that_is_ignored_is_no_interruption():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        with Interruption() as interruption:
            signal.raise_signal(signal.SIGHUP)
            assert not interruption.requested
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_source_that_breaks_later_ends(recording, in_memory, stamps):
    frames = list(recording.frames(raise_damage))
    reading = Reading(in_memory(frames, on_frame=broken_at(4)), None)
    assert read(reading) == stamps[:4]
    assert reading.ended == 'the index is broken'


def test_a_source_that_fails_at_once_is_rejected(recording, in_memory):
    frames = list(recording.frames(raise_damage))
    with pytest.raises(InputError, match='index is broken'):
        read(Reading(in_memory(frames, on_frame=broken_at(0)), None))


def test_each_reading_ends_for_its_own_reason(recording, in_memory, stamps):
    breaks = [4]

    def on_frame(index, on_damaged):
        if index in breaks:
            breaks.clear()
            raise InputError('the index is broken')
    reading = Reading(in_memory(list(recording.frames(raise_damage)), on_frame=on_frame), None)
    assert (len(read(reading)), reading.ended) == (4, 'the index is broken')
    assert (read(reading), reading.ended) == (stamps, COMPLETE)


def test_damage_is_logged_where_it_is_asked_for(recording):
    damage = DamageLog()
    assert Reading(recording, None, damage).damage is damage
    first, second = Reading(recording, None).damage, Reading(recording, None).damage
    assert isinstance(first, DamageLog) and first is not second


def test_the_user_may_end_a_source_before_its_first_frame(recording, in_memory):
    """As one of which all images are damaged, and there are many."""
    def damaged(index, on_damaged):
        for _ in range(100):
            on_damaged(InputError('damaged'))
    seen = []

    def on_damaged(error):
        seen.append(error)
        if len(seen) == 3:
            signal.raise_signal(signal.SIGINT)
    frames = list(recording.frames(raise_damage))
    with Reading(in_memory(frames, on_frame=damaged), None) as reading:
        with pytest.raises(KeyboardInterrupt):
            next(reading.frames(on_damaged))
    assert len(seen) == 3
